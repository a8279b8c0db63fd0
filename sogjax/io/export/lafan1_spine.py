"""The three links of LAFAN1's spine, of however many a body has."""

from collections.abc import Sequence

import numpy as np

from sogjax.errors import InputError
from sogjax.io.export.named_bones import NamedBones, median_in
from sogjax.io.export.two_bones import middle_joint, shortest_turns

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
