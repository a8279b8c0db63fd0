"""The hierarchy of a BVH file: every channel becomes a one-axis joint with a degree of freedom of its own."""

from pathlib import Path

from sogjax.io.actor_rows import WORLD
from sogjax.io.bvh_bones import BvhBone, read_bones
from sogjax.io.skeletons.rows import SkeletonRows, attach_blobs


def read_bvh_hierarchy(path: Path) -> SkeletonRows:
    """The skeleton of a BVH file, with blobs along its bones and a landmark at every joint.

    Raises:
        InputError: the file cannot be read, or its hierarchy is damaged.
    """
    rows = SkeletonRows(path.stem)
    last: list[str] = []
    for bone in read_bones(path):
        last.append(_add_joints(rows, bone, WORLD if bone.parent < 0 else last[bone.parent]))
        if bone.end is not None:
            rows.ends[last[-1]] = bone.end
    attach_blobs(rows)
    return rows


def _add_joints(rows: SkeletonRows, bone: BvhBone, parent: str) -> str:
    """One joint per channel, positions first: BVH moves a bone before turning it, in any order of channels.

    Returns:
        The last of them.
    """
    offset = bone.offset
    for channel in sorted(bone.channels, key=lambda channel: not channel.endswith("position")):
        axis, kind = channel[0].lower(), "prismatic" if channel.endswith("position") else "revolute"
        name = f"{bone.name}_{'t' if kind == 'prismatic' else 'r'}{axis}"
        rows.add_joint(name, parent, offset, axis, kind)
        rows.dofs.append({"name": name, "limits": "none", "joints": {name: 1.0}})
        parent, offset = name, [0.0] * 3
    if not bone.channels:
        rows.add_joint(f"{bone.name}_fixed", parent, offset, "x", "revolute")
        parent = f"{bone.name}_fixed"
    rows.landmarks.append({"name": bone.name, "joint": parent, "offset": [0.0] * 3})
    return parent
