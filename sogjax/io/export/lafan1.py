"""BVH as the LAFAN1 data set has it, which tools that bring human motion to robots read.

Centimetres, Y up, 22 joints by LAFAN1's names in its order. A bone's X points along it; Y points forward (trunk, legs),
backward (arms) or up (feet) where the body stands straight. Only the root has channels of position.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.export.bones import Bones, bone_frames, bones_of, frame_time, in_parents, world_turn
from sogjax.io.export.bvh import Dialect, Figure, write_figure
from sogjax.io.export.feet import middle_joint, shortest_turns, standing_feet
from sogjax.io.motion_data import MotionData

DIALECT = Dialect(order="ZYX", unit=100.0)
SIDES = ("left", "right")
_MOST_CHANGE = 0.005
"""Metres that a bone's length may change and still be written as constant."""


@dataclass(frozen=True)
class _Joint:
    """A joint of a limb, and the joints of the body that it is made of."""

    name: str
    above: str
    at: str
    """The bone, or landmark, that it begins at."""
    until: str
    """Where its bone ends, another bone or a landmark."""
    frame: str
    """The bone that it turns with; `above:NAME` is the one above NAME."""
    beside: tuple[float, float, float]
    """Where its Y points where the body stands straight, with Y up and Z forward."""


def _of_side(side: str) -> list[_Joint]:
    leg, foot, arm = (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0)
    name = lambda bone: f"{side.title()}{bone}"
    own = lambda joint: f"{side}_{joint}"
    return [
        _Joint(name("UpLeg"), "Hips", own("hip"), own("knee"), own("hip"), leg),
        _Joint(name("Leg"), name("UpLeg"), own("knee"), own("ankle"), own("knee"), leg),
        _Joint(name("Foot"), name("Leg"), own("ankle"), own("toe"), own("ankle"), foot),
        _Joint(name("Toe"), name("Foot"), own("toe"), "", own("ankle"), foot),
        _Joint(name("Shoulder"), "Spine2", own("clavicle"), own("shoulder"), own("clavicle"), arm),
        _Joint(name("Arm"), name("Shoulder"), own("shoulder"), own("elbow"), f"above:{own('elbow')}", arm),
        _Joint(name("ForeArm"), name("Arm"), own("elbow"), own("wrist"), own("elbow"), arm),
        _Joint(name("Hand"), name("ForeArm"), own("wrist"), own("hand"), own("wrist"), arm),
    ]


_LEGS = [joint for side in SIDES for joint in _of_side(side)[:4]]
_ARMS = [joint for side in SIDES for joint in _of_side(side)[4:]]
NAMES = (
    *("Hips", *(joint.name for joint in _LEGS)),
    *("Spine", "Spine1", "Spine2", "Neck", "Head", *(joint.name for joint in _ARMS)),
)
_PARENTS = {joint.name: joint.above for joint in (*_LEGS, *_ARMS)} | {
    **{"Spine": "Hips", "Spine1": "Spine", "Spine2": "Spine1", "Neck": "Spine2", "Head": "Neck"},
}


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


def write_lafan1(path: Path, motion: MotionData, up: str = "z") -> str:
    """Write `motion`, whose world has the vertical `up`; feet that stand keep their place.

    Returns:
        A sentence: how far standing feet slid, before and after.

    Raises:
        InputError: a body without one of the joints, or with bones whose lengths change; no frames, or unevenly spaced
            ones; a path that cannot be written.
    """
    seconds = frame_time(path, motion)
    figure, said = standing_feet(figure_of(path, motion, up), seconds)
    write_figure(path, figure, seconds, DIALECT)
    return said


def figure_of(where: Path | str, motion: MotionData, up: str) -> Figure:
    """The motion by LAFAN1's joints, before anything is done to its feet; `where` begins sentences about it.

    Raises:
        InputError: a body without one of them, or with bones whose lengths change.
    """
    body = NamedBones(where, motion, up)
    frames = {"Hips": (body.turns(HIPS) @ TRUNK, body.places(HIPS))}
    frames |= spine_frames(body)
    frames |= {name: (body.turns(name.lower()) @ TRUNK, body.places(name.lower())) for name in ("Neck", "Head")}
    for joint in (*_LEGS, *_ARMS):
        frames[joint.name] = (body.turns(joint.frame) @ _axes(body, joint), body.places(joint.at))
    order = {name: index for index, name in enumerate(NAMES)}
    bones = Bones(NAMES, tuple(order[_PARENTS[name]] if name in _PARENTS else -1 for name in NAMES), ())
    rotations, positions = (np.stack([frames[name][k] for name in NAMES], axis=1) for k in (0, 1))
    return Figure(bones, rotations, _constant(where, bones, rotations, positions), _ends(body, frames))


def _axes(body: NamedBones, joint: _Joint) -> Float[np.ndarray, "3 3"]:
    """A joint's own axes in those of the bone that it turns with."""
    toe = not joint.until
    along = FORWARD if toe else np.array([0.0, -1.0, 0.0])
    if joint.until and body.knows(joint.until):
        along = median_in(body.turns(joint.frame), body.places(joint.until) - body.places(joint.at))
    x = along / np.linalg.norm(along)
    y = np.array(joint.beside) - np.dot(joint.beside, x) * x
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _constant(
    where: Path | str,
    bones: Bones,
    rotations: Float[np.ndarray, "frame bone 3 3"],
    positions: Float[np.ndarray, "frame bone 3"],
) -> Float[np.ndarray, "frame bone 3"]:
    """Positions with constant offsets of the bones from those above them.

    Raises:
        InputError: one changes by more than rounding.
    """
    _, offsets = in_parents(bones, rotations, positions)
    placed = positions.copy()
    for bone, above in enumerate(bones.parents):
        if above < 0:
            continue
        offset = np.median(offsets[:, bone], axis=0)
        if np.abs(offsets[:, bone] - offset).max() > _MOST_CHANGE:
            raise InputError(
                f"{where}: the lafan1 dialect has bones of constant length, but the one above {bones.names[bone]} "
                "changes its own; leave dialect out"
            )
        placed[:, bone] = placed[:, above] + rotations[:, above] @ offset
    return placed


def _ends(body: NamedBones, frames: dict[str, tuple[np.ndarray, np.ndarray]]) -> Float[np.ndarray, "bone 3"]:
    """Where head, hands and toes end, in their own frames; metres."""
    usual = {"Head": 0.15, "LeftToe": 0.05, "RightToe": 0.05}
    landmarks = {"Head": "head_top", "LeftHand": "left_hand", "RightHand": "right_hand"}
    ends = np.array([[usual.get(name, 0.08), 0.0, 0.0] for name in NAMES])
    for name, landmark in landmarks.items():
        if body.knows(landmark):
            turns, places = frames[name]
            ends[NAMES.index(name)] = median_in(turns, body.places(landmark) - places)
    return ends


UP, FORWARD = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])
TRUNK = np.stack([UP, FORWARD, np.cross(UP, FORWARD)], axis=1)
"""The trunk's own axes where the body stands straight, with Y up and Z forward."""
HIPS = "above:left_hip"
"""The bone that the legs hang from."""
_BULGE = 0.02
"""Metres: a spine bends backward where its own joints do not tell."""


def spine_frames(body: NamedBones) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Rotations and places of Spine, Spine1 and Spine2, of the body's own joints between hips and neck.

    Spine2 is the bone that carries the neck. Of three or more, all between the first and the last become one
    joint, which lies where two bones of constant length meet; where there are fewer, bones are divided.

    Raises:
        InputError: the neck hangs from the hips.
    """
    root, chain = body.bone(HIPS), [body.bone("above:neck")]
    while chain[0] not in (root, -1):
        chain.insert(0, body.bones.parents[chain[0]])
    names = [body.bones.names[bone] for bone in chain[1:]]
    if not names:
        raise InputError(f"{body.where}: the lafan1 dialect has a spine, but the motion's neck hangs from its root")
    turns, places = body.turns, body.places
    if len(names) < 3:
        return _divided(body, names)
    first, middle, last = names[0], names[len(names) // 2], names[-1]
    spans = [np.linalg.norm(places(b) - places(a), axis=-1).max() for a, b in ((first, middle), (middle, last))]
    back = -_BULGE * turns(first) @ FORWARD
    meet = middle_joint(places(first), places(middle) + back, places(last), (float(spans[0]), float(spans[1])))
    found = {"Spine2": (turns(last) @ TRUNK, places(last))}
    for name, bone, begin, end in (("Spine", first, places(first), meet), ("Spine1", middle, meet, places(last))):
        straight = turns(bone) @ median_in(turns(bone), end - begin)
        found[name] = (shortest_turns(straight, end - begin) @ turns(bone) @ TRUNK, begin)
    return found


def _divided(body: NamedBones, names: Sequence[str]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The three where the body has one or two: the bone below the last of them is divided."""
    last = names[-1]
    below = names[0] if len(names) == 2 else HIPS
    lower, upper = body.places(below), body.places(last)
    own = body.turns(below) @ TRUNK
    parts = {"Spine": 0.0, "Spine1": 1.0 / 2.0} if len(names) == 2 else {"Spine": 1.0 / 3.0, "Spine1": 2.0 / 3.0}
    placed = {name: (own, (1.0 - part) * lower + part * upper) for name, part in parts.items()}
    return placed | {"Spine2": (body.turns(last) @ TRUNK, upper)}
