"""The bones and landmarks of a person by name, for formats that ask for certain ones."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.bones import bone_frames, bones_of, world_turn
from sogjax.io.motion_data import MotionData


class NamedBones:
    """Bones and landmarks of a motion by name, in a world with y up."""

    def __init__(self, where: Path | str, motion: MotionData, up: str) -> None:
        self.where, self.motion, self.turn = where, motion, world_turn(up, "y")
        self.bones = bones_of(motion)
        self._rotations, self._positions = bone_frames(motion, self.bones, up, "y")

    def bone(self, name: str) -> int:
        """The index of a bone; `above:NAME` is the one above NAME.

        Raises:
            InputError: there is none.
        """
        below = name.removeprefix("above:")
        if below in self.bones.names:
            found = self.bones.names.index(below)
            found = found if below == name else self.bones.parents[found]
        else:
            found = -1
        if found < 0:
            whose = f" of {self.motion.actor}" if self.motion.actor else ""
            raise InputError(
                f"{self.where}: the lafan1 dialect is that of a person, but the motion{whose} has no joint "
                f"{name.replace(':', ' ')}; leave dialect out"
            )
        return found

    def turns(self, name: str) -> Float[np.ndarray, "frame 3 3"]:
        """World from bone; a straight body's bones have the world's axes."""
        return self._rotations[:, self.bone(name)]

    def places(self, name: str) -> Float[np.ndarray, "frame 3"]:
        """Where a bone begins or a landmark is, metres."""
        if name not in self.bones.names and self.knows(name):
            return self.motion.joint(name).astype(float) @ self.turn.T
        return self._positions[:, self.bone(name)]

    def knows(self, name: str) -> bool:
        """Whether there is a bone or landmark of this name."""
        landmarks = [] if self.motion.landmark_names is None else self.motion.landmark_names.tolist()
        return name in self.bones.names or name in landmarks


def median_in(
    rotations: Float[np.ndarray, "frame 3 3"], vectors: Float[np.ndarray, "frame 3"]
) -> Float[np.ndarray, "3"]:
    """The median of vectors in turning frames."""
    return np.median(np.einsum("tji,tj->ti", rotations, vectors), axis=0)
