"""Skeletons of other programs as bodies: one reader per format, chosen by the content of the file."""

from pathlib import Path

import jax.numpy as jnp

from sogjax.errors import InputError
from sogjax.io import bvh_bones
from sogjax.io.actor_file import body_from
from sogjax.io.actor_rows import WORLD
from sogjax.io.bvh_bones import BvhBone, read_bones
from sogjax.io.calibration.rig import METRES
from sogjax.io.skeletons import skeletool
from sogjax.io.skeletons.rows import SkeletonRows, attach_blobs
from sogjax.io.skeletons.skeletool import read_skeletool_skeleton
from sogjax.io.yaml_entry import Entry
from sogjax.model.body import Body
from sogjax.model.rotation import world_from_upright


def read_skeleton(path: Path, dof: Path | None = None, unit: str | None = None, up: str = "y") -> Body:
    """The body of a `.skeleton` (with a `.dof`, if given) or of the hierarchy of a BVH, standing upright.

    `unit` (m, cm, mm) says what the file's lengths are, where it is not what the format prescribes (BVH: nothing, so
    metres are taken); `up` is the vertical of the file's rest pose.

    Raises:
        InputError: an unknown format, something wrong inside, or lengths that are those of no such unit.
    """
    head = _head(path)
    if head.startswith(skeletool.HEADER):
        rows, prescribed = read_skeletool_skeleton(path, dof), "mm"
    elif head.startswith(bvh_bones.HEADER):
        if dof is not None:
            raise InputError(f"{dof}: belongs to a .skeleton of Skeletool, but {path} is not one; leave it out")
        rows, prescribed = read_bvh_hierarchy(path), "m"
    else:
        raise InputError(f"{path}: is not a skeleton of a known format; give a .skeleton of Skeletool or a .bvh")
    chosen = unit or prescribed
    body = body_from(Entry(path, "", rows.document()), METRES[chosen])
    extent = METRES[chosen] * rows.extent()
    if not 0.05 <= extent <= 10.0:  # metres; a skeleton of another size is suspected to be in another unit
        others = ", ".join(other for other in METRES if other != chosen)
        raise InputError(f"{path}: its rest pose is {extent:.3g} m in size in {chosen}; give unit= as one of {others}")
    return body.rotated(jnp.asarray(world_from_upright(up).T, body.blob_sigmas.dtype))


def _head(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return file.read(4096).decode("utf-8-sig", errors="replace").lstrip()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path") from error


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
