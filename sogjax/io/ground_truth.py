"""Ground truth of a recording: markers and joints in the calibration's world, and joint angles."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.npz_file import float_array, number, read_npz, save_npz, text_array


@dataclass
class GroundTruth:
    """Measured markers and joints, in metres in the calibration's world; NaN where a point is not known.

    With several subjects the names carry the prefix `SUBJECT/`.
    """

    fps: float
    markers: Float[np.ndarray, "frame marker 3"] | None = None
    marker_names: tuple[str, ...] = ()
    joints: Float[np.ndarray, "frame joint 3"] | None = None
    joint_names: tuple[str, ...] = ()
    angles: Float[np.ndarray, "frame angle"] | None = None
    """Degrees, by the names and conventions of `sogjax.io.export.angles`; NaN where one is not known."""
    angle_names: tuple[str, ...] = ()

    @property
    def num_frames(self) -> int:
        """Number of frames."""
        return max((len(points) for points in (self.markers, self.joints) if points is not None), default=0)

    @property
    def subjects(self) -> tuple[str, ...]:
        """The subjects that the names are prefixed with, sorted; empty where there is only one."""
        names = (*self.marker_names, *self.joint_names, *self.angle_names)
        return tuple(sorted({name.split("/", 1)[0] for name in names if "/" in name}))

    def subject(self, name: str) -> "GroundTruth":
        """The truth of one subject, its names without the prefix.

        Raises:
            InputError: no name has the prefix.
        """
        markers, marker_names = _select(self.markers, self.marker_names, f"{name}/")
        joints, joint_names = _select(self.joints, self.joint_names, f"{name}/")
        angles, angle_names = _select(self.angles, self.angle_names, f"{name}/")
        if not marker_names and not joint_names:
            known = ", ".join(self.subjects) or "none, the names carry no prefix"
            raise InputError(f"the ground truth has no subject {name!r}; its subjects are: {known}")
        return GroundTruth(self.fps, markers, marker_names, joints, joint_names, angles, angle_names)


def load_ground_truth(path: Path) -> GroundTruth:
    """Read `ground_truth.npz`.

    Raises:
        InputError: no such file, no npz, or a key of the wrong kind.
    """
    arrays = read_npz(path)
    fps = number(path, arrays, "fps")
    if not (np.isfinite(fps) and fps > 0):
        raise InputError(f"{path}: fps = {fps} is not positive; give the frames per second")
    markers, marker_names = _points(path, arrays, "markers", "marker_names")
    joints, joint_names = _points(path, arrays, "joints", "joint_names")
    if joints is not None and not np.isfinite(joints).any():
        raise InputError(f"{path}: 'joints' holds NaN only; label some of them, or leave them out")
    if markers is None and joints is None:
        raise InputError(f"{path}: holds neither 'markers' nor 'joints'; add one of them")
    if markers is not None and joints is not None and len(markers) != len(joints):
        counts = f"'markers' has {counted(len(markers), 'frame')} and 'joints' {len(joints)}"
        raise InputError(f"{path}: {counts}; make them equal")
    angles, angle_names = _points(path, arrays, "angles", "angle_names", ())
    points = next(each for each in (markers, joints) if each is not None)
    if angles is not None and len(angles) != len(points):
        raise InputError(
            f"{path}: 'angles' has {counted(len(angles), 'frame')} and the points {len(points)}; make them equal"
        )
    return GroundTruth(fps, markers, marker_names, joints, joint_names, angles, angle_names)


def save_ground_truth(path: Path, truth: GroundTruth) -> None:
    """Write `ground_truth.npz`."""
    arrays: dict[str, np.ndarray] = {"fps": np.array(truth.fps, float)}
    if truth.markers is not None:
        arrays |= {"markers": truth.markers, "marker_names": np.array(truth.marker_names, str)}
    if truth.joints is not None:
        arrays |= {"joints": truth.joints, "joint_names": np.array(truth.joint_names, str)}
    if truth.angles is not None:
        arrays |= {"angles": truth.angles, "angle_names": np.array(truth.angle_names, str)}
    save_npz(path, arrays)


def _points(
    path: Path, arrays: dict[str, np.ndarray], key: str, names_key: str, each: tuple[int, ...] = (3,)
) -> tuple[Float[np.ndarray, "frame point *each"] | None, tuple[str, ...]]:
    if key not in arrays:
        return None, ()
    points = float_array(path, arrays, key, (None, None, *each))
    names = tuple(text_array(path, arrays, names_key, (points.shape[1],)).tolist())
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise InputError(f"{path}: {names_key!r} holds {twice!r} twice; give each its own name")
    if np.isinf(points).any():
        raise InputError(f"{path}: {key!r} holds infinite numbers; write NaN where one is not known")
    return points, names


def _select(
    points: Float[np.ndarray, "frame point *each"] | None, names: tuple[str, ...], prefix: str
) -> tuple[Float[np.ndarray, "frame chosen *each"] | None, tuple[str, ...]]:
    chosen = [index for index, name in enumerate(names) if name.startswith(prefix)]
    if points is None or not chosen:
        return None, ()
    return points[:, chosen], tuple(names[index].removeprefix(prefix) for index in chosen)
