"""BVH, the hierarchy and channels that Blender and most animation programs read.

Y is up, +Z is where a body in its rest pose looks, lengths are metres unless asked otherwise, angles degrees.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from sogjax.io.export.bones import CONSTANT, bone_frames, bones_of, frame_time, world_turn
from sogjax.io.files import atomic_path
from sogjax.io.motion_data import MotionData

PER_METRE = {"m": 1.0, "cm": 100.0}
"""The units of length that a BVH file may be written in; the file itself does not say which."""

_SHORTEST_END = 0.01
_DEFAULT_END = 0.05


@dataclass
class _Bone:
    """A BVH joint: a chain of one-axis joints of one origin, in BVH's axes, relative to the parent bone."""

    name: str
    is_root: bool
    positions: Float[np.ndarray, "frame 3"]
    angles: Float[np.ndarray, "frame 3"]
    """Degrees about Z, X, Y, each turned by the ones before it."""
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


def write_bvh(path: Path, motion: MotionData, up: str = "z", unit: str = "m") -> None:
    """Write `motion`, whose world has the vertical `up`, as BVH with Y up; lengths in `unit` (`m`, `cm`).

    One-axis joints that share their origin become one BVH joint with three rotation channels. The root, and
    joints that slide, have position channels too.

    Raises:
        InputError: no frames, unevenly spaced frames, or a path that cannot be written.
        ValueError: no such unit.
    """
    if unit not in PER_METRE:
        raise ValueError(f"no unit {unit!r}; use one of {', '.join(PER_METRE)}")
    seconds = frame_time(path, motion)
    root = _root_bone(motion, up, PER_METRE[unit])
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
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _root_bone(motion: MotionData, up: str, scale: float) -> _Bone:
    """The tree of bones, with lengths times `scale`."""
    found = bones_of(motion)
    rotations, positions = bone_frames(motion, found, up, "y")
    turn = world_turn(up, "y")
    blobs = motion.blob_means.astype(float) @ turn.T
    bones: list[_Bone] = []
    for index, (name, above) in enumerate(zip(found.names, found.parents, strict=True)):
        position, rotation = positions[:, index], rotations[:, index]
        attached = (blobs[0, np.isin(motion.blob_joint, found.chains[index])] - position[0]) @ rotation[0]
        if above >= 0:
            to_parent = np.swapaxes(rotations[:, above], -1, -2)
            position = np.einsum("tij,tj->ti", to_parent, position - positions[:, above])
            rotation = to_parent @ rotation
        bone = _Bone(
            name=name,
            is_root=above < 0,
            positions=position * scale,
            angles=_euler_angles(rotation),
            end=_end(attached, position[0]) * scale,
        )
        bones.append(bone)
        if above >= 0:
            bones[above].children.append(bone)
    roots = [bone for bone in bones if bone.is_root]
    return roots[0] if len(roots) == 1 else _common_root(roots)


def _euler_angles(rotation: Float[np.ndarray, "frame 3 3"]) -> Float[np.ndarray, "frame 3"]:
    """Degrees about Z, X, Y without jumps of a turn."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # at X = 90 degrees scipy says that it chooses one of many
        angles = Rotation.from_matrix(rotation).as_euler("ZXY", degrees=True)
    return np.unwrap(angles, axis=0, period=360.0)


def _end(attached: Float[np.ndarray, "blob 3"], offset: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    """The farthest blob of a bone, or a short continuation of its parent."""
    if len(attached):
        farthest = attached[np.linalg.norm(attached, axis=-1).argmax()]
        if np.linalg.norm(farthest) > _SHORTEST_END:
            return farthest
    length = np.linalg.norm(offset)
    return _DEFAULT_END * (offset / length if length > _SHORTEST_END else np.array([0.0, 1.0, 0.0]))


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
