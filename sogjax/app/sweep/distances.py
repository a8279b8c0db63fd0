"""How far the motions of a sweep's members are from those of the first: what a setting changes, without any truth."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from sogjax.data.motion import Motion, load_motion
from sogjax.errors import InputError

MM = 1000.0


def distances_to_first(folders: Sequence[Path | None]) -> list[float]:
    """For each folder of results the distance of its motions to those of the first one, in millimetres.

    NaN for members without a folder and where nothing can be compared.
    """
    first: Mapping[str, Motion] | None = None
    distances = []
    for folder in folders:
        motions = {} if folder is None else _motions(folder)
        if first is None and motions:
            first = motions
        distances.append(float("nan") if first is None else MM * mean_distance(motions, first))
    return distances


def mean_distance(motions: Mapping[str, Motion], others: Mapping[str, Motion]) -> float:
    """Metres, the mean over actors, frames and joints that both have; NaN where there are none."""
    parts = [_apart(motions[name], others[name]).ravel() for name in motions if name in others]
    apart = np.concatenate(parts) if parts else np.zeros(0)
    return float(apart.mean()) if apart.size else float("nan")


def _apart(motion: Motion, other: Motion) -> np.ndarray:
    _, rows, other_rows = np.intersect1d(motion.frame, other.frame, return_indices=True)
    _, joints, other_joints = np.intersect1d(motion.joint_names, other.joint_names, return_indices=True)
    places = motion.world_from_joint[np.ix_(rows, joints)][..., :3, 3]
    return np.linalg.norm(places - other.world_from_joint[np.ix_(other_rows, other_joints)][..., :3, 3], axis=-1)


def _motions(folder: Path) -> dict[str, Motion]:
    """The motions of a member by the names of their files; none where one cannot be read."""
    try:
        return {path.stem: load_motion(path) for path in sorted(folder.glob("motion*.npz"))}
    except InputError:
        return {}
