"""The bones of a motion: what other programs know of a skeleton, each of them a few one-axis joints of one origin."""

import warnings
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.motion_data import MotionData
from sogjax.model.rotation import world_from_upright

CONSTANT = 1e-4
"""Metres within which an offset counts as constant."""


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
    return Bones(tuple(names), parents, tuple(map(tuple, chains)))


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


def in_parents(
    bones: Bones, rotations: Float[np.ndarray, "frame bone 3 3"], positions: Float[np.ndarray, "frame bone 3"]
) -> tuple[Float[np.ndarray, "frame bone 3 3"], Float[np.ndarray, "frame bone 3"]]:
    """The rotations and origins of bones in the frames of their parents; those of roots as they are."""
    turns, offsets = rotations.copy(), positions.copy()
    for bone, above in enumerate(bones.parents):
        if above >= 0:
            to_parent = np.swapaxes(rotations[:, above], -1, -2)
            turns[:, bone] = to_parent @ rotations[:, bone]
            offsets[:, bone] = np.einsum("tij,tj->ti", to_parent, positions[:, bone] - positions[:, above])
    return turns, offsets


def euler_angles(rotations: Float[np.ndarray, "frame 3 3"], order: str) -> Float[np.ndarray, "frame 3"]:
    """Degrees about three axes, each turned by the ones before it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # at 90 degrees about the middle axis one of many is chosen
        return Rotation.from_matrix(rotations).as_euler(order, degrees=True)


def frame_time(path: Path, motion: MotionData) -> float:
    """Seconds from one frame to the next, for a format that has one number for it.

    Raises:
        InputError: no frames, or unevenly spaced ones.
    """
    ending = path.suffix.lstrip(".").upper()
    steps = np.unique(np.diff(motion.frame))
    check_frames(path, motion)
    if len(steps) > 1:
        raise InputError(
            f"{path}: {ending} needs evenly spaced frames, but the motion's lie {steps[0]} to {steps[-1]} apart; "
            "track it without gaps"
        )
    return float(steps[0] if len(steps) else 1) / motion.fps


def check_frames(path: Path, motion: MotionData) -> None:
    """Check that there is anything to write, and all of it finite.

    Raises:
        InputError: no frames, or as `check_finite`.
    """
    if motion.num_frames == 0:
        raise InputError(f"{path}: the motion has no frames; export one that has")
    check_finite(path, motion)


def check_finite(path: Path, motion: MotionData) -> None:
    """Check that the motion is known in every frame.

    Raises:
        InputError: it is not.
    """
    unknown = motion.frame[~np.isfinite(motion.world_from_joint).all(axis=(1, 2, 3))]
    if len(unknown):
        raise InputError(f"{path}: the motion has numbers that are not finite in frame {unknown[0]}; track it again")


def _chains(motion: MotionData) -> list[list[int]]:
    """The joints that make one bone each, parents first.

    A joint continues its parent's chain if it is the only child and does not leave the origin; also, in the
    chain of the root, if it slides.
    """
    parents = motion.joint_parents
    origins = motion.world_from_joint[..., :3, 3]
    num_children = np.bincount(parents[parents >= 0], minlength=len(parents))
    chain_of: list[list[int]] = []
    for joint, parent in enumerate(parents.tolist()):
        continues = False
        if parent >= 0 and num_children[parent] == 1:
            apart = np.linalg.norm(origins[:, joint] - origins[:, parent], axis=-1).max()
            at_root = parents[chain_of[parent][0]] < 0
            continues = apart < 1e-5 or bool(at_root and _slides(motion, joint))  # metres
        chain_of.append(chain_of[parent] if continues else [])
        chain_of[joint].append(joint)
    return [chain for joint, chain in enumerate(chain_of) if chain[0] == joint]


def _slides(motion: MotionData, joint: int) -> bool:
    """Whether the offset of a joint from its parent changes."""
    parent = motion.world_from_joint[:, motion.joint_parents[joint]]
    apart = motion.world_from_joint[:, joint, :3, 3] - parent[:, :3, 3]
    offset = np.einsum("tji,tj->ti", parent[:, :3, :3], apart)
    return bool(np.ptp(offset, axis=0).max() > CONSTANT)


def _unique_names(chains: list[list[str]]) -> list[str]:
    """A name for every chain: the words with which all its joints' names begin, else its last joint's name."""
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
