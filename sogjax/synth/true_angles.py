"""The joint angles of the figure's own skeleton, by the names and conventions of the files that are written."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from sogjax.io.export.angles import segment_angles
from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.rotations import partial_twist

_OF_SIDE = {
    **{"thigh": "hip", "shank": "knee", "foot": "ankle"},
    **{"upper_arm": "shoulder", "forearm": "elbow", "hand": "wrist"},
}
"""The figure's joints whose frames its segments are; their axes are the body's where it stands straight."""


def true_angles(
    people: Sequence[Anatomy], poses: Callable[[int], Sequence[Pose]], prefixes: Sequence[str], num_frames: int
) -> tuple[Float[np.ndarray, "frame angle"], tuple[str, ...]]:
    """Degrees, and the angles' names, each person's with a prefix, of people in a world with z up."""
    known: list[dict[str, list[np.ndarray]]] = [{} for _ in people]
    for frame in range(num_frames):
        for turns, anatomy, pose in zip(known, people, poses(frame), strict=True):
            for name, turn in _segments(anatomy, pose).items():
                turns.setdefault(name, []).append(turn)
    columns = {
        prefix + name: values
        for prefix, turns in zip(prefixes, known, strict=True)
        for name, values in segment_angles({name: np.stack(each) for name, each in turns.items()}).items()
    }
    return np.stack(list(columns.values()), axis=1), tuple(columns)


def _segments(anatomy: Anatomy, pose: Pose) -> dict[str, Float[np.ndarray, "3 3"]]:
    """World frames of the segments; the end of the forearm follows all of the wrist's twist, and none of its swing."""
    frames = anatomy.world_from_joint(pose)[:, :3, :3]
    turns = {name: frames[INDEX[name]] for name in ("pelvis", "chest", "head")}
    for side in SIDES:
        turns |= {f"{side}_{segment}": frames[INDEX[f"{side}_{joint}"]] for segment, joint in _OF_SIDE.items()}
        wrist = pose.rotations[INDEX[f"{side}_wrist"]]
        twist = partial_twist(wrist, 0.0).T @ wrist
        turns[f"{side}_forearm_end"] = turns[f"{side}_forearm"] @ twist
    return turns
