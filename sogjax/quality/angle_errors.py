"""Joint angles against true ones: by joint and plane, in degrees."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

NAN = float("nan")
LEAST_RANGE = 5.0
"""Degrees: of an angle that hardly moves a ratio of ranges, and how alike two curves are, say nothing."""
SAGITTAL, FRONTAL, TRANSVERSE = "sagittal", "frontal", "transverse"
BETWEEN_BONES = "between bones"
"""Stands for the plane where an angle is that between lines that join joints."""
PLANES: dict[str, tuple[str, str]] = {
    **{"hip_flexion": ("hip", SAGITTAL), "hip_adduction": ("hip", FRONTAL), "hip_rotation": ("hip", TRANSVERSE)},
    "knee_angle": ("knee", SAGITTAL),
    **{"ankle_angle": ("ankle", SAGITTAL), "subtalar_angle": ("ankle", FRONTAL)},
    **{"pelvis_tilt": ("pelvis", SAGITTAL), "pelvis_list": ("pelvis", FRONTAL)},
    "pelvis_rotation": ("pelvis", TRANSVERSE),
    **{"lumbar_extension": ("lumbar", SAGITTAL), "lumbar_bending": ("lumbar", FRONTAL)},
    "lumbar_rotation": ("lumbar", TRANSVERSE),
    **{"neck_extension": ("neck", SAGITTAL), "neck_bending": ("neck", FRONTAL), "neck_rotation": ("neck", TRANSVERSE)},
    **{"arm_flex": ("shoulder", SAGITTAL), "arm_add": ("shoulder", FRONTAL), "arm_rot": ("shoulder", TRANSVERSE)},
    **{"elbow_flex": ("elbow", SAGITTAL), "pro_sup": ("forearm", TRANSVERSE)},
    **{"wrist_flex": ("wrist", "flexion"), "wrist_dev": ("wrist", "deviation")},
}
"""Joint and plane of each angle, by its name without the side."""
ROW = "{:<26}{:>9}{:>9}{:>9}{:>9}{:>9}{:>7}"


@dataclass(frozen=True)
class AngleError:
    """How far an angle is from the true one, in degrees; NaN where that says nothing."""

    name: str
    joint: str
    plane: str
    mean_abs: float
    offset: float
    """The mean of the differences, ours less the true one."""
    mean_abs_centred: float
    """The mean of the absolute differences once the offset is removed."""
    rms_centred: float
    range_ratio: float
    """Our range of motion (largest less smallest value) over the true one."""
    cmc: float
    """The coefficient of multiple correlation (Kadaba 1989) of the two curves; NaN where it is not real."""
    num_values: int


def base_name(name: str) -> str:
    """The name of an angle without its side: `knee_angle_r` is `knee_angle`."""
    return name[:-2] if name.endswith(("_l", "_r")) else name


def angle_error(name: str, ours: Float[np.ndarray, "frame"], true: Float[np.ndarray, "frame"]) -> AngleError | None:
    """Errors of one angle (degrees, both unwrapped) over the frames that both have; None where there are none."""
    both = np.isfinite(ours) & np.isfinite(true)
    if not both.any():
        return None
    true, apart = true[both], (ours - true)[both]
    # Past an angle that means nothing (gimbal lock) one of the two may be a turn off: counted from the mean direction,
    # as a heading that differs by half a turn lies on either side of it.
    middle = np.degrees(np.angle(np.exp(1j * np.radians(apart)).mean()))
    apart = middle + (apart - middle + 180.0) % 360.0 - 180.0
    ours, offset = true + apart, float(apart.mean())
    centred = np.abs(apart - offset)
    joint, plane = PLANES.get(base_name(name), (base_name(name), BETWEEN_BONES))
    moves = np.ptp(true) >= LEAST_RANGE
    return AngleError(
        name=name,
        joint=joint,
        plane=plane,
        mean_abs=float(np.abs(apart).mean()),
        offset=offset,
        mean_abs_centred=float(centred.mean()),
        rms_centred=float(np.sqrt((centred**2).mean())),
        range_ratio=float(np.ptp(ours) / np.ptp(true)) if moves else NAN,
        cmc=multiple_correlation(ours, true) if moves else NAN,
        num_values=int(both.sum()),
    )


def angle_errors(
    ours: Mapping[str, Float[np.ndarray, "frame"]], true: Mapping[str, Float[np.ndarray, "frame"]]
) -> tuple[AngleError, ...]:
    """Errors of the angles that both know, in the order of the true ones."""
    found = [angle_error(name, ours[name], values) for name, values in true.items() if name in ours]
    return tuple(each for each in found if each is not None)


def multiple_correlation(one: Float[np.ndarray, "frame"], other: Float[np.ndarray, "frame"]) -> float:
    """The coefficient of multiple correlation of two curves: 1 where they are the same; NaN where it is not real."""
    curves = np.stack([one, other])
    num_curves, num_frames = curves.shape
    within = ((curves - curves.mean(axis=0)) ** 2).sum() / (num_frames * (num_curves - 1))
    total = ((curves - curves.mean()) ** 2).sum() / (num_curves * num_frames - 1)
    squared = 1.0 - within / total if total > 0 else NAN
    return float(np.sqrt(squared)) if squared >= 0 else NAN


def angle_table(errors: Sequence[AngleError], details: bool = True) -> list[str]:
    """A line for each joint and plane, left and right together, and with details one for each angle."""
    if not errors:
        return []
    lines = [ROW.format("angles, degrees", "mean abs", "offset", "centred", "rms", "range", "CMC")]
    for (joint, plane), each in by_plane(errors).items():
        lines.append(_row(f"{joint} {plane}", each))
        if details and len(each) > 1:
            lines += [_row(f"  {error.name}", [error]) for error in each]
    lines.append(
        "angles: mean absolute error; offset; mean absolute and rms error without the offset; ratio of the ranges "
        "of motion; coefficient of multiple correlation"
    )
    return lines


def by_plane(errors: Sequence[AngleError]) -> dict[tuple[str, str], list[AngleError]]:
    """The errors of each joint and plane, both sides'."""
    found: dict[tuple[str, str], list[AngleError]] = {}
    for error in errors:
        found.setdefault((error.joint, error.plane), []).append(error)
    return found


def pooled(errors: Sequence[AngleError]) -> dict[str, float]:
    """Means over some angles; offsets by their absolute values, NaN where none has a number."""
    rows = [{**asdict(error), "offset": abs(error.offset) if len(errors) > 1 else error.offset} for error in errors]
    keys = ("mean_abs", "offset", "mean_abs_centred", "rms_centred", "range_ratio", "cmc")
    return {key: _mean([row[key] for row in rows]) for key in keys}


def angles_dict(errors: Sequence[AngleError]) -> dict[str, Any]:
    """The errors for JSON: by joint and plane, and of each angle."""
    return {
        "unit": "degrees",
        "by_plane": {f"{joint} {plane}": pooled(each) for (joint, plane), each in by_plane(errors).items()},
        "per_angle": {error.name: asdict(error) for error in errors},
    }


def _row(title: str, errors: Sequence[AngleError]) -> str:
    numbers = pooled(errors)
    shown = [f"{numbers[key]:.1f}" for key in ("mean_abs", "offset", "mean_abs_centred", "rms_centred")]
    ratios = [_ratio(numbers[key]) for key in ("range_ratio", "cmc")]
    return ROW.format(title, *shown, *ratios)


def _ratio(value: float) -> str:
    return "-" if value != value else f"{value:.2f}"


def _mean(values: Sequence[float]) -> float:
    finite = [value for value in values if value == value]
    return float(np.mean(finite)) if finite else NAN
