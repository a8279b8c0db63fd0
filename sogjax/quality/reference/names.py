"""Which points, angles and segments of another system are those of the motion, by their names."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.angles import has_angles
from sogjax.io.export.bones import bone_frames, bones_of, world_turn
from sogjax.io.motion import Motion
from sogjax.io.reference.names import point_named, segment_named
from sogjax.io.reference.reference_motion import ReferenceMotion

Points = Mapping[str, Float[np.ndarray, "frame 3"]]
"""Places by name, metres in a world with y up."""
Columns = Mapping[str, Float[np.ndarray, "frame"]]
"""Angles by name, degrees."""


@dataclass(frozen=True)
class CommonNames:
    """What both know."""

    points: dict[str, str]
    """Our name of each of their points."""
    angles: tuple[str, ...]
    segments: dict[str, str]
    """Their bone for each of our segments."""

    def not_matched(self, reference: ReferenceMotion) -> list[str]:
        """What of the other system's is not compared, in a line."""
        bones = set(self.segments.values())
        points = [name for name in reference.points if name not in self.points and name not in bones]
        rest = [*points, *(name for name in reference.angles if name not in self.angles)]
        return [f"not matched, and not compared: {', '.join(rest)}"] if rest else []


def common_names(motion: Motion, reference: ReferenceMotion, ours: Points, our_angles: Columns) -> CommonNames:
    """Names of points, angles and segments that the motion and the other system share.

    Raises:
        InputError: none of a file's angles, or none of its points, is one of the motion.
    """
    points = _points(reference, ours)
    angles = tuple(name for name in reference.angles if name in our_angles)
    if not angles and (reference.angles or not points):
        theirs = ", ".join([*reference.angles, *reference.points][:8])
        whose = f" of {motion.actor}" if motion.actor else ""
        raise InputError(
            f"{reference.path}: none of its names ({theirs}, ...) is a joint or angle of the motion{whose}; give one "
            "with names such as knee_angle_r or RKnee, or the motion of such a body"
        )
    found = {segment_named(bone): bone for bone in reference.turns} if has_angles(motion) else {}
    return CommonNames(points, angles, {segment: bone for segment, bone in found.items() if segment is not None})


def our_points(motion: Motion) -> dict[str, Float[np.ndarray, "frame 3"]]:
    """Landmarks and origins of bones in a world with y up, by their names."""
    bones = bones_of(motion)
    _, positions = bone_frames(motion, bones, motion.up, "y")
    landmarks = [] if motion.landmark_names is None else map(str, motion.landmark_names)
    turn = world_turn(motion.up, "y").T
    return dict(zip(bones.names, positions.swapaxes(0, 1), strict=True)) | {
        name: motion.joint(name).astype(float) @ turn for name in landmarks
    }


def _points(reference: ReferenceMotion, ours: Points) -> dict[str, str]:
    """Our name of each of the other system's points that is a point of the motion, too."""
    found: dict[str, str] = {}
    for name in reference.points:
        if name in reference.turns and name in ours:  # a bone of our own files
            found[name] = name
        elif (known := point_named(name, bool(reference.turns))) in ours and known not in found.values():
            found[name] = known
    return found
