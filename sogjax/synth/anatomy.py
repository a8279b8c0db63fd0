"""The figure's own skeleton: joints with three degrees of freedom each, proportions drawn from a seed."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

_CENTRE = {"pelvis": "", "spine": "pelvis", "waist": "spine", "chest": "waist", "neck": "chest", "head": "neck"}
_SIDE = {
    **{"clavicle": "chest", "shoulder": "clavicle", "elbow": "shoulder", "wrist": "elbow"},
    **{"hip": "pelvis", "knee": "hip", "ankle": "knee", "toe": "ankle"},
}
"""Joints and their parents."""

SIDES = ("left", "right")
JOINTS = (*_CENTRE, *(f"{side}_{name}" for side in SIDES for name in _SIDE))
"""The 22 joints, parents first. The frames of all of them are the body's (x forward, y left, z up) when the
figure stands upright with hanging arms."""

INDEX = {name: i for i, name in enumerate(JOINTS)}


def _parent_index(name: str) -> int:
    side, _, base = name.rpartition("_")
    parent = (_CENTRE | _SIDE)[base]
    return INDEX.get(parent, INDEX.get(f"{side}_{parent}", -1))


def _levels() -> list[tuple[list[int], list[int]]]:
    """The joints below the root, those of one depth together, and their parents."""
    depth = [0] * len(PARENTS)
    for joint, parent in enumerate(PARENTS):
        depth[joint] = 0 if parent < 0 else depth[parent] + 1
    groups = [[j for j, d in enumerate(depth) if d == level] for level in range(1, max(depth) + 1)]
    return [(joints, [PARENTS[j] for j in joints]) for joints in groups]


PARENTS = tuple(_parent_index(name) for name in JOINTS)
_LEVELS = _levels()


@dataclass(frozen=True)
class Pose:
    """Where the pelvis is (metres, world) and how every joint is turned.

    `rotations` are parent_from_joint; that of the pelvis is world_from_joint.
    """

    position: Float[np.ndarray, "3"]
    rotations: Float[np.ndarray, "22 3 3"]

    def with_rotation(self, joint: str, rotation: Float[np.ndarray, "3 3"]) -> "Pose":
        """The same pose with one joint turned differently."""
        rotations = self.rotations.copy()
        rotations[INDEX[joint]] = rotation
        return Pose(self.position, rotations)


@dataclass(frozen=True)
class Anatomy:
    """Bone lengths and thickness of one person; lengths in metres."""

    stature: float
    girth: float
    """Thickness of the flesh, 1 = average."""
    offsets: Float[np.ndarray, "22 3"]
    """Places of the joints in their parents' frames."""
    shoulder_breadth: float
    """Relative to the average."""

    def length(self, joint: str) -> float:
        """Length of the bone from the joint's parent to it."""
        return float(np.linalg.norm(self.offsets[INDEX[joint]]))

    @property
    def hip_height(self) -> float:
        """Height of the hips over the floor, standing upright."""
        return float(self.ankle_height - sum(self.offsets[INDEX[f"left_{name}"]][2] for name in ("knee", "ankle")))

    @property
    def ankle_height(self) -> float:
        """Height of the ankle over the sole."""
        return 0.044 * self.stature

    def world_from_joint(self, pose: Pose) -> Float[np.ndarray, "22 4 4"]:
        """Forward kinematics."""
        frames = np.zeros((len(JOINTS), 4, 4))
        frames[:, :3, :3], frames[:, 3, 3] = pose.rotations, 1.0
        frames[:, :3, 3] = self.offsets
        frames[0, :3, 3] = pose.position
        for joints, parents in _LEVELS:
            frames[joints] = frames[parents] @ frames[joints]
        return frames


def anatomy_from_seed(rng: np.random.Generator) -> Anatomy:
    """Draw a person: stature 1.60 to 1.90 m, limb proportions within about 4 %, girth within about 9 %."""
    stature = float(rng.uniform(1.60, 1.90))
    girth = float(rng.uniform(0.90, 1.08))
    legs, arms, breadth = (float(value) for value in rng.uniform(0.965, 1.035, 3))
    offsets = np.zeros((len(JOINTS), 3))
    # With longer legs everything is a little smaller, so that the stature stays what it is.
    size = stature / (0.522 + 0.478 * legs)

    def place(name: str, x: float, y: float, z: float) -> None:
        offsets[INDEX[name]] = np.array([x, y, z]) * size

    place("spine", -0.004, 0.0, 0.058)
    place("waist", 0.0, 0.0, 0.062)
    place("chest", 0.0, 0.0, 0.068)
    place("neck", -0.008, 0.0, 0.136)
    place("head", 0.010, 0.0, 0.058)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        place(f"{side}_clavicle", 0.002, 0.022 * sign, 0.113)
        place(f"{side}_shoulder", -0.006, 0.083 * breadth * sign, -0.012)
        place(f"{side}_elbow", 0.0, 0.0, -0.170 * arms)
        place(f"{side}_wrist", 0.0, 0.0, -0.147 * arms)
        place(f"{side}_hip", 0.0, 0.050 * sign, 0.0)
        place(f"{side}_knee", 0.0, 0.0, -0.240 * legs)
        place(f"{side}_ankle", 0.0, 0.0, -0.238 * legs)
        place(f"{side}_toe", 0.082, 0.0, -0.032)
    return Anatomy(stature, girth, offsets, breadth)
