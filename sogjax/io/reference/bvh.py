"""Joints of a BVH file: where they are, and how their bones are turned."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.bvh_bones import MAX_BYTES, BvhBone, read_bones
from sogjax.io.files import read_text
from sogjax.io.reference.reference_motion import ReferenceMotion, checked

_LARGEST_PERSON = 4.0
"""A skeleton that is more across at rest is not in metres but in centimetres."""


def read_bvh(path: Path) -> ReferenceMotion:
    """World positions of the joints; y is up, lengths are metres, or centimetres where a body is larger than 4 m.

    Raises:
        InputError: the file is no BVH, or damaged.
    """
    joints = read_bones(path)
    rest = read_text(path, MAX_BYTES).partition("\nMOTION")[2]
    numbers = re.match(r"\s*Frames:\s*(\d+)\s*Frame Time:\s*(\S+)", rest)
    if numbers is None or not joints:
        raise InputError(f"{path}: has no ROOT, 'Frames:' and 'Frame Time:'; is this a whole BVH?")
    width = sum(len(joint.channels) for joint in joints)
    try:
        step = float(numbers[2])
        values = np.array(rest[numbers.end() :].split(), float).reshape(int(numbers[1]), width)
    except ValueError:
        raise InputError(f"{path}: does not hold {numbers[1]} rows of {width} numbers; is the file whole?") from None
    if not step > 0:
        raise InputError(f"{path}: Frame Time is {numbers[2]}; it should be seconds, more than 0")
    turns, positions = _frames(joints, values)
    unit = 0.01 if _across(joints) > _LARGEST_PERSON else 1.0
    points = {joint.name: unit * positions[:, k] for k, joint in enumerate(joints)}
    notes = ("lengths were taken for centimetres",) if unit != 1.0 else ()
    return checked(ReferenceMotion(path, 1.0 / step, step * np.arange(len(values)), points, turns=turns, notes=notes))


def _frames(
    joints: Sequence[BvhBone], values: Float[np.ndarray, "frame channel"]
) -> tuple[dict[str, Float[np.ndarray, "frame 3 3"]], Float[np.ndarray, "frame joint 3"]]:
    """World rotations by joint and positions, by forward kinematics.

    Channels of position take the place of the offset, those of rotation act in their order.
    """
    turns: list[Float[np.ndarray, "frame 3 3"]] = []
    places: list[Float[np.ndarray, "frame 3"]] = []
    first = 0
    for joint in joints:
        own = values[:, first : first + len(joint.channels)]
        first += len(joint.channels)
        offset = np.tile(joint.offset, (len(values), 1))
        axes = [k for k, name in enumerate(joint.channels) if name.endswith("rotation")]
        for k, name in enumerate(joint.channels):
            if name.endswith("position"):
                offset[:, "XYZ".index(name[0])] = own[:, k]
        turn = np.tile(np.eye(3), (len(values), 1, 1))
        if axes:
            order = "".join(joint.channels[k][0] for k in axes)
            turn = Rotation.from_euler(order, own[:, axes], degrees=True).as_matrix()
        if joint.parent >= 0:
            above = turns[joint.parent]
            offset = places[joint.parent] + np.einsum("tij,tj->ti", above, offset)
            turn = above @ turn
        turns.append(turn)
        places.append(offset)
    names = [joint.name for joint in joints]
    return dict(zip(names, turns, strict=True)), np.stack(places, axis=1)


def _across(joints: Sequence[BvhBone]) -> float:
    """How far apart a skeleton's joints are at most, in the file's unit, without turning any."""
    places: list[np.ndarray] = []
    for joint in joints:
        places.append((places[joint.parent] + joint.offset) if joint.parent >= 0 else np.zeros(3))
    return float(np.ptp(np.stack(places), axis=0).max())
