"""Skeletons of other programs as bodies: one reader per format, chosen by the content of the file."""

from pathlib import Path

import jax.numpy as jnp

from sogjax.errors import InputError
from sogjax.io import bvh_bones
from sogjax.io.actor_file import body_from
from sogjax.io.calibration.rig import METRES
from sogjax.io.skeletons import skeletool
from sogjax.io.skeletons.bvh_hierarchy import read_bvh_hierarchy
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
