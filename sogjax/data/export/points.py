"""Which points of a motion marker files hold: joint centres and extremities under OpenSim's usual names."""

import re

import numpy as np
from jaxtyping import Float

from sogjax.data.export.bones import bone_frames, bones_of, world_turn
from sogjax.data.keypoints import named_scheme
from sogjax.data.motion import Motion

_JOINTS = {"hip": "Hip", "knee": "Knee", "ankle": "Ankle", "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist"}
_ENDS = {"toe": "BigToe", "small_toe": "SmallToe", "heel": "Heel", "hand": "Hand"}


def _both_sides(names: dict[str, str]) -> dict[str, str]:
    return {f"{side}_{ours}": side[0].upper() + name for side in ("left", "right") for ours, name in names.items()}


OPENSIM_NAMES = {"root": "Hip", "neck": "Neck"} | _both_sides(_JOINTS)
"""The names that OpenSim models for video have (Pose2Sim's), by those of the default body's bones."""
OPENSIM_ENDS = {"head_top": "Head"} | _both_sides(_ENDS)
"""The same of the landmarks where a body ends."""
EVERY_BONE = "all"
_ROLL = re.compile(r"_roll\d*$")
"""Bones that only turn about the line to the next joint: their origins are no joint centres."""


def marker_points(
    motion: Motion, up: str, to: str, markers: str | None = None
) -> tuple[list[str], Float[np.ndarray, "frame marker 3"]]:
    """Names and positions (metres) of the points, in a world turned from the vertical `up` to `to`.

    Args:
        motion: whose points.
        up: the vertical of its world.
        to: that of the file's.
        markers: None: joint centres, toes, heels, hands and the top of the head; `all`: every bone, too, those that
            only roll as well; else a keypoint scheme, by name or file, whose points are written under its names.

    Raises:
        InputError: no such scheme, or the motion lacks one of its points.
    """
    if markers not in (None, EVERY_BONE):
        scheme = named_scheme(str(markers))
        points = np.stack([motion.joint(name).astype(float) for name in scheme.landmarks], axis=1)
        return list(scheme.keypoints), points @ world_turn(up, to).T
    bones = bones_of(motion)
    _, positions = bone_frames(motion, bones, up, to)
    kept = [k for k, name in enumerate(bones.names) if markers == EVERY_BONE or not _ROLL.search(name)]
    names = [OPENSIM_NAMES.get(bones.names[k], bones.names[k]) for k in kept]
    known = [] if motion.landmark_names is None else motion.landmark_names.tolist()
    ends = [name for name in OPENSIM_ENDS if name in known]
    places = [motion.joint(name).astype(float) @ world_turn(up, to).T for name in ends]
    return names + [OPENSIM_ENDS[name] for name in ends], np.stack([*positions[:, kept].swapaxes(0, 1), *places], 1)
