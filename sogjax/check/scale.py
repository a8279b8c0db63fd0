"""How large the subject is according to the calibration, and where it stands: this shows units, vertical and floor."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.check.agreement import MomentHull
from sogjax.check.cameras import RigGeometry
from sogjax.check.findings import Finding
from sogjax.model.camera import NEAR, distort, project_points
from sogjax.model.rotation import axis_vector

EXPECTED_HEIGHT, EXPECTED_DISTANCE = 1.7, 4.0
"""Metres: the height of a person, and the distance from the cameras to what they look at."""


SMALLEST = 0.02
"""Metres: animals that are filmed, and the way to them, are larger."""


@dataclass(frozen=True)
class SubjectSize:
    """Extent of the subject along the vertical, in metres by the calibration as it is read."""

    height: float
    lowest: float


def subject_size(hulls: Sequence[MomentHull], good: Sequence[int], scale: float, up: str) -> SubjectSize | None:
    """The median over moments and over the cameras that agree; `scale` (metres) is the hulls' unit of length."""
    shown = [(hull, camera) for hull in hulls for camera in hull.masks if camera in good]
    ends = [both for hull, camera in shown if (both := _ends(hull, camera, axis_vector(up))) is not None]
    if not ends:
        return None
    low, high = np.median(ends, axis=0) * scale
    return SubjectSize(float(high - low), float(low))


def _ends(hull: MomentHull, camera: int, axis: Float[np.ndarray, "3"]) -> tuple[float, float] | None:
    """Lowest and highest point of a silhouette on the vertical line through the subject's middle.

    The visual hull itself is no use: with few cameras it extends beyond head and feet. A thousandth of the silhouette's
    pixels at either end does not count.
    """
    seen, mask = hull.cameras[camera], hull.masks[camera]
    heights = np.linspace(-1.0, 1.0, 201) * hull.cube.size
    line = hull.cube.centre + heights[:, None] * axis
    points, depths = project_points(seen, jnp.asarray(line, seen.intrinsics.dtype))
    usable = np.asarray(depths) > NEAR
    pixels = np.asarray(distort(seen, points), float)[usable]
    if len(pixels) < 2:
        return None
    direction = pixels[-1] - pixels[0]
    along = pixels @ direction
    order = np.argsort(along)
    silhouette = np.argwhere(mask)[:, ::-1] @ direction
    base = float(hull.cube.centre @ axis)
    low, high = np.interp(np.percentile(silhouette, [0.1, 99.9]), along[order], heights[usable][order])
    return base + float(low), base + float(high)


def scale_findings(
    size: SubjectSize | None, geometry: RigGeometry, unit: str | None, subject: float | None = None
) -> list[Finding]:
    """Whether the unit of length is right, and where the floor is.

    Args:
        size: of what is seen, if anything is.
        geometry: of the cameras.
        unit: that of recording.yaml.
        subject: the extent of the body that is to be tracked, metres; None: nobody said, so it may be an animal.
    """
    expected = EXPECTED_HEIGHT if subject is None else subject
    if size is None:
        return _by_distance(geometry, unit, subject)
    shown, share = f"the subject is {_length(size.height)} tall according to the calibration", size.height / expected
    whose = f"a person about {EXPECTED_HEIGHT} m" if subject is None else f"the body {_length(subject)}"
    if not 0.15 <= share <= 2.4:  # no subject of usual size, but another unit
        found = _wrong_unit(f"{shown}, {whose}", 1.0 / share, unit)
        return [_small_or_wrong(found) if subject is None and SMALLEST <= size.height < expected else found]
    findings = []
    if 0.7 <= share <= 1.55:  # raised arms included
        findings.append(Finding("ok", "unit", shown))
    else:
        cause = "a subject that is not an adult, masks of only a part of it, or a wrong unit"
        findings.append(Finding("note", "unit", shown, cause, "measure something in the scene, and compare"))
    if abs(size.lowest) > 0.15 * expected:
        what = f"the lowest point of the subject is at {size.lowest:.2f} m along the vertical, not near 0"
        cause = "a world whose zero is not on the floor, a wrong `up`, or a subject off the floor"
        findings.append(Finding("note", "vertical", what, cause, "nothing, if intended; else level the calibration"))
    return findings


def _by_distance(geometry: RigGeometry, unit: str | None, subject: float | None) -> list[Finding]:
    """Without a subject, the distance to what the cameras look at is used, if they look at one point."""
    if len(geometry.names) < 2 or not _look_together(geometry):
        return []
    shown = f"the cameras are {_length(geometry.scale)} from what they look at"
    persons = 1.0 if subject is None else subject / EXPECTED_HEIGHT
    if 0.4 * min(persons, 1.0) <= geometry.scale <= 40.0 * max(persons, 1.0):
        return [Finding("ok", "unit", f"{shown}, which is plausible; there is no silhouette to measure")]
    usual = "2 to 8 m is usual for people" if subject is None else f"and the body is {_length(subject)} tall"
    found = _wrong_unit(f"{shown}, {usual}", EXPECTED_DISTANCE * persons / geometry.scale, unit)
    return [_small_or_wrong(found) if subject is None and SMALLEST <= geometry.scale < 0.4 else found]


def _small_or_wrong(found: Finding) -> Finding:
    """The finding where an animal may be filmed from near: nobody said what is to be tracked."""
    remedy = f"give the body that is to be tracked, as body=FILE, if that is right; else {found.remedy}"
    return replace(found, severity="warning", cause=f"a small animal, or {found.cause}", remedy=remedy)


def _wrong_unit(what: str, factor: float, unit: str | None) -> Finding:
    """The finding that lengths are only as expected if multiplied with a `factor`; beyond 3, it is an error."""
    given = {"mm": 1e-3}.get(unit or "m", 1.0)
    units = {"millimetres": 1e-3, "centimetres": 1e-2, "inches": 0.0254, "feet": 0.3048, "metres": 1.0}
    likely = min(units, key=lambda name: abs(np.log(units[name] / (factor * given))))
    words = {"millimetres": "`unit: mm`", "metres": "`unit: m`"}
    remedy = f"write {words[likely]} into recording.yaml" if likely in words else "convert the translations to metres"
    severity = "error" if abs(np.log(factor)) > np.log(3.0) else "warning"
    return Finding(severity, "unit", what, f"a calibration in {likely}", remedy)


def implausible_distance(geometry: RigGeometry, unit: str | None, subject: float) -> str | None:
    """Why nothing can be tracked at the scale of a calibration, and the remedy; None: it can.

    `subject` is the extent of the body in metres. A person is filmed from 0.3 to 50 m, small animals also from nearer,
    large ones from farther away.
    """
    if not _look_together(geometry):
        return None
    persons = subject / EXPECTED_HEIGHT
    if 0.3 * min(persons, 1.0) <= geometry.scale <= 50.0 * max(persons, 1.0):
        return None
    factor = EXPECTED_DISTANCE / geometry.scale * persons
    shown = f"the cameras are {_length(geometry.scale)} from what they look at, and the body is {_length(subject)} tall"
    return _wrong_unit(shown, factor, unit).sentence()


def _look_together(geometry: RigGeometry) -> bool:
    """Whether the directions of two cameras differ by more than 5 degrees; else they look at no one point."""
    return bool((geometry.forwards @ geometry.forwards.T).min() < np.cos(np.deg2rad(5.0)))


def _length(metres: float) -> str:
    return f"{metres:.2f} m" if metres >= 0.1 else f"{1000 * metres:.3g} mm"
