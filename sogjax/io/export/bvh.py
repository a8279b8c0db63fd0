"""BVH, the hierarchy and channels that Blender and most animation programs read.

Y is up, +Z is where a body in its rest pose looks, lengths are metres, angles degrees.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.io.export.bones import CONSTANT, bone_frames, bones_of, euler_angles, frame_time, in_parents, world_turn
from sogjax.io.files import write_file
from sogjax.io.motion_data import MotionData


@dataclass
class _Bone:
    """A BVH joint: a chain of one-axis joints of one origin, in BVH's axes, relative to the parent bone."""

    name: str
    is_root: bool
    positions: Float[np.ndarray, "frame 3"]
    angles: Float[np.ndarray, "frame 3"]
    """Degrees about Z, X, Y, each turned by the ones before it, without jumps of a turn."""
    end: Float[np.ndarray, "3"]
    """Where the bone ends, if it has no children."""
    children: list["_Bone"] = field(default_factory=list)

    @property
    def moves(self) -> bool:
        """Whether it needs position channels."""
        return self.is_root or bool(np.ptp(self.positions, axis=0).max() > CONSTANT)

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
    root = _root_bone(motion, up)
    bones = list(_depth_first(root))
    channels = [np.concatenate([bone.positions, bone.angles], 1) if bone.moves else bone.angles for bone in bones]
    lines = [
        "HIERARCHY",
        *_hierarchy(root),
        "MOTION",
        f"Frames: {motion.num_frames}",
        f"Frame Time: {seconds:.9f}",
    ]
    lines += [_numbers(row) for row in np.concatenate(channels, axis=1)]
    write_file(path, "\n".join(lines) + "\n")


def _root_bone(motion: MotionData, up: str) -> _Bone:
    """The tree of bones."""
    found = bones_of(motion)
    rotations, positions = bone_frames(motion, found, up, "y")
    turns, offsets = in_parents(found, rotations, positions)
    blobs = motion.blob_means[0].astype(float) @ world_turn(up, "y").T
    bones: list[_Bone] = []
    for index, (name, above) in enumerate(zip(found.names, found.parents, strict=True)):
        of_bone = np.isin(motion.blob_joint, found.chains[index])
        attached = (blobs[of_bone] - positions[0, index]) @ rotations[0, index]
        bone = _Bone(
            name=name,
            is_root=above < 0,
            positions=offsets[:, index],
            angles=np.unwrap(euler_angles(turns[:, index], "ZXY"), axis=0, period=360.0),
            end=_end(attached, offsets[0, index]),
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
    return _Bone("world", True, still, still, np.zeros(3), roots)


def _depth_first(bone: _Bone) -> Iterator[_Bone]:
    yield bone
    for child in bone.children:
        yield from _depth_first(child)


def _hierarchy(bone: _Bone) -> list[str]:
    """The lines that define a bone and what hangs from it."""
    channels = ["Xposition", "Yposition", "Zposition"] if bone.moves else []
    channels += ["Zrotation", "Xrotation", "Yrotation"]
    inner = [f"OFFSET {_numbers(bone.offset)}", f"CHANNELS {len(channels)} {' '.join(channels)}"]
    for child in bone.children:
        inner += _hierarchy(child)
    if not bone.children:
        inner += ["End Site", "{", f"  OFFSET {_numbers(bone.end)}", "}"]
    kind = "ROOT" if bone.is_root else "JOINT"
    return [f"{kind} {bone.name}", "{", *("  " + line for line in inner), "}"]


def _numbers(values: Float[np.ndarray, "n"]) -> str:
    return " ".join(f"{value:.6f}" for value in values)
