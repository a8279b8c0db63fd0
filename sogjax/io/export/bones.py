"""The bones of a motion: what other programs know of a skeleton, each of them a few one-axis joints of one origin."""

from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.motion_data import MotionData
from sogjax.model.rotation import world_from_upright

CONSTANT = 1e-4
"""Metres within which an offset counts as constant."""

_SAME_PLACE = 1e-5
"""Metres within which joints share their origin."""


@dataclass(frozen=True)
class Bones:
    """The bones of a motion, parents before their children."""

    names: tuple[str, ...]
    parents: tuple[int, ...]
    """The bone above each, or -1."""
    chains: tuple[tuple[int, ...], ...]
    """The joints that make each bone, parents first; the last one's frame is the bone's."""


def bones_of(motion: MotionData) -> Bones:
    """The bones that the joints of a motion make."""
    chains = _chains(motion)
    names = _unique_names([[str(motion.joint_names[j]) for j in chain] for chain in chains])
    bone_of = {joint: bone for bone, chain in enumerate(chains) for joint in chain} | {-1: -1}
    parents = tuple(bone_of[int(motion.joint_parents[chain[0]])] for chain in chains)
    return Bones(tuple(names), parents, tuple(tuple(chain) for chain in chains))


def world_turn(up: str, to: str) -> Float[np.ndarray, "3 3"]:
    """The rotation from a world with the vertical `up` to one with the vertical `to`."""
    return world_from_upright(to) @ world_from_upright(up).T


def bone_frames(
    motion: MotionData, bones: Bones, up: str, to: str
) -> tuple[Float[np.ndarray, "frame bone 3 3"], Float[np.ndarray, "frame bone 3"]]:
    """Rotations and origins (metres) of the bones, in a world turned from the vertical `up` to `to`.

    The bones' own axes are turned as well: in the rest pose they are the world's.
    """
    turn = world_turn(up, to)
    frames = motion.world_from_joint[:, [chain[-1] for chain in bones.chains]].astype(float)
    return turn @ frames[..., :3, :3] @ turn.T, frames[..., :3, 3] @ turn.T


def frame_time(path: Path, motion: MotionData) -> float:
    """Seconds from one frame to the next, for a format that has one number for it.

    Raises:
        InputError: no frames, or unevenly spaced ones.
    """
    ending = path.suffix.lstrip(".").upper()
    steps = np.unique(np.diff(motion.frame))
    if motion.num_frames == 0:
        raise InputError(f"{path}: the motion has no frames; export one that has")
    if len(steps) > 1:
        raise InputError(
            f"{path}: {ending} needs evenly spaced frames, but the motion's lie {steps[0]} to {steps[-1]} apart; "
            "track it without gaps"
        )
    return float(steps[0] if len(steps) else 1) / motion.fps


def _chains(motion: MotionData) -> list[list[int]]:
    """The joints that make one bone each, parents first.

    A joint continues its parent's chain if it is the only child and does not leave the origin; also, in the
    chain of the root, if it slides.
    """
    parents = motion.joint_parents
    origins = motion.world_from_joint[..., :3, 3]
    num_children = np.bincount(parents[parents >= 0], minlength=len(parents))
    chains: list[list[int]] = []
    chain_of: dict[int, list[int]] = {}
    for joint, parent in enumerate(parents.tolist()):
        continues = False
        if parent >= 0 and num_children[parent] == 1:
            apart = np.linalg.norm(origins[:, joint] - origins[:, parent], axis=-1).max()
            at_root = parents[chain_of[parent][0]] < 0
            continues = apart < _SAME_PLACE or bool(at_root and _slides(motion, joint))
        if continues:
            chain_of[joint] = chain_of[parent]
            chain_of[joint].append(joint)
        else:
            chain_of[joint] = [joint]
            chains.append(chain_of[joint])
    return chains


def _slides(motion: MotionData, joint: int) -> bool:
    """Whether the offset of a joint from its parent changes."""
    parent = motion.world_from_joint[:, motion.joint_parents[joint]]
    apart = motion.world_from_joint[:, joint, :3, 3] - parent[:, :3, 3]
    offset = np.einsum("tji,tj->ti", parent[:, :3, :3], apart)
    return bool(np.ptp(offset, axis=0).max() > CONSTANT)


def _unique_names(chains: list[list[str]]) -> list[str]:
    """For every chain the words with which all its joints' names begin, else its last joint's name."""
    names: list[str] = []
    for chain in chains:
        columns = zip(*(name.split("_") for name in chain), strict=False)
        words = [column[0] for column in takewhile(lambda column: len(set(column)) == 1, columns)]
        name = "_".join("_".join(words or [chain[-1]]).split())
        if name in names:
            name = "_".join(chain[-1].split())
        while name in names:
            name += "_"
        names.append(name)
    return names
