"""BVH, the hierarchy and channels that Blender and most animation programs read.

Y is up, +Z is where a body in its rest pose looks, angles are degrees, lengths metres unless a dialect has others.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.io.export.bones import (
    CONSTANT,
    Bones,
    bone_frames,
    bones_of,
    euler_angles,
    frame_time,
    in_parents,
    world_turn,
)
from sogjax.io.files import write_file
from sogjax.io.motion_data import MotionData


@dataclass(frozen=True)
class Figure:
    """Bones over time, in a world with y up; metres."""

    bones: Bones
    rotations: Float[np.ndarray, "frame bone 3 3"]
    """World from bone."""
    positions: Float[np.ndarray, "frame bone 3"]
    """Where each bone begins."""
    ends: Float[np.ndarray, "bone 3"]
    """Where a bone without children ends, in its own frame."""


@dataclass(frozen=True)
class Dialect:
    """What one program's BVH files have otherwise than another's."""

    order: str = "ZXY"
    """The axes that a joint turns about, each turned by the ones before it."""
    unit: float = 1.0
    """Lengths in the file of one metre."""


@dataclass
class _Bone:
    """A BVH joint, relative to the parent bone; in the file's unit."""

    name: str
    is_root: bool
    positions: Float[np.ndarray, "frame 3"]
    angles: Float[np.ndarray, "frame 3"]
    """Degrees about the dialect's axes, without jumps of a turn."""
    end: Float[np.ndarray, "3"]
    """Where the bone ends, if it has no children."""
    least: float
    """What an offset must change for it to have channels."""
    children: list["_Bone"] = field(default_factory=list)

    @property
    def moves(self) -> bool:
        """Whether it needs position channels."""
        return self.is_root or bool(np.ptp(self.positions, axis=0).max() > self.least)

    @property
    def offset(self) -> Float[np.ndarray, "3"]:
        return np.zeros(3) if self.is_root else np.median(self.positions, axis=0)


def write_bvh(path: Path, motion: MotionData, up: str = "z") -> None:
    """Write `motion`, whose world has the vertical `up`, as BVH with Y up.

    One-axis joints that share their origin become one BVH joint with three rotation channels. The root, and
    joints that slide, have position channels too.

    Raises:
        InputError: no frames, unevenly spaced frames, or a path that cannot be written.
    """
    seconds = frame_time(path, motion)
    write_figure(path, _figure(motion, up), seconds, Dialect())


def write_figure(path: Path, figure: Figure, seconds: float, dialect: Dialect) -> None:
    """Write bones, one row for each `seconds`.

    Raises:
        InputError: a path that cannot be written.
    """
    root = _root_bone(figure, dialect)
    bones = list(_depth_first(root))
    channels = [np.concatenate([bone.positions, bone.angles], 1) if bone.moves else bone.angles for bone in bones]
    lines = [
        "HIERARCHY",
        *_hierarchy(root, dialect.order),
        "MOTION",
        f"Frames: {len(figure.positions)}",
        f"Frame Time: {seconds:.9f}",
    ]
    lines += [_numbers(row) for row in np.concatenate(channels, axis=1)]
    write_file(path, "\n".join(lines) + "\n")


def _figure(motion: MotionData, up: str) -> Figure:
    """A motion's own bones."""
    found = bones_of(motion)
    rotations, positions = bone_frames(motion, found, up, "y")
    _, offsets = in_parents(found, rotations, positions)
    blobs = motion.blob_means[0].astype(float) @ world_turn(up, "y").T
    ends = []
    for index in range(len(found.names)):
        of_bone = np.isin(motion.blob_joint, found.chains[index])
        ends.append(_end((blobs[of_bone] - positions[0, index]) @ rotations[0, index], offsets[0, index]))
    return Figure(found, rotations, positions, np.stack(ends))


def _root_bone(figure: Figure, dialect: Dialect) -> _Bone:
    """The tree of bones."""
    turns, offsets = in_parents(figure.bones, figure.rotations, figure.positions)
    bones: list[_Bone] = []
    for index, (name, above) in enumerate(zip(figure.bones.names, figure.bones.parents, strict=True)):
        bone = _Bone(
            name=name,
            is_root=above < 0,
            positions=dialect.unit * offsets[:, index],
            angles=np.unwrap(euler_angles(turns[:, index], dialect.order), axis=0, period=360.0),
            end=dialect.unit * figure.ends[index],
            least=dialect.unit * CONSTANT,
        )
        bones.append(bone)
        if above >= 0:
            bones[above].children.append(bone)
    roots = [bone for bone in bones if bone.is_root]
    return roots[0] if len(roots) == 1 else _common_root(roots)


def _end(attached: Float[np.ndarray, "blob 3"], offset: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """Where a bone without children ends: at its farthest blob, else a little beyond its parent; metres."""
    shortest, usual = 0.01, 0.05
    if len(attached):
        farthest = attached[np.linalg.norm(attached, axis=-1).argmax()]
        if np.linalg.norm(farthest) > shortest:
            return farthest
    length = np.linalg.norm(offset)
    return usual * (offset / length if length > shortest else np.array([0.0, 1.0, 0.0]))


def _common_root(roots: list[_Bone]) -> _Bone:
    """A still bone at the origin that holds several roots."""
    still = np.zeros_like(roots[0].positions)
    for root in roots:
        root.is_root = False
    return _Bone("world", True, still, still, np.zeros(3), roots[0].least, roots)


def _depth_first(bone: _Bone) -> Iterator[_Bone]:
    yield bone
    for child in bone.children:
        yield from _depth_first(child)


def _hierarchy(bone: _Bone, order: str) -> list[str]:
    """The lines that define a bone, whose channels have this order, and what hangs from it."""
    channels = ["Xposition", "Yposition", "Zposition"] if bone.moves else []
    channels += [f"{axis}rotation" for axis in order]
    inner = [f"OFFSET {_numbers(bone.offset)}", f"CHANNELS {len(channels)} {' '.join(channels)}"]
    for child in bone.children:
        inner += _hierarchy(child, order)
    if not bone.children:
        inner += ["End Site", "{", f"  OFFSET {_numbers(bone.end)}", "}"]
    kind = "ROOT" if bone.is_root else "JOINT"
    return [f"{kind} {bone.name}", "{", *("  " + line for line in inner), "}"]


def _numbers(values: Float[np.ndarray, "n"]) -> str:
    return " ".join(f"{value:.6f}" for value in values)
