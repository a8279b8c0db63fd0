"""Blobs along the bones of a skeleton that has none: a start, which the actor's pictures then scale.

Along every bone, from a joint to a child elsewhere or to the bone's end: four blobs, two where the bone is shorter
than a tenth of the skeleton, one below a twenty-fifth. They share the bone evenly and their sigma is half of such a
share, so that neighbours touch where each counts as body. All are grey.
"""

import re
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from sogjax.data.actor_rows import WORLD
from sogjax.data.skeletons.rows import SkeletonRows

BLOBS_OF_BONES = ((0.1, 4), (0.04, 2), (0.0, 1))
"""Bones longer than this part of the skeleton's extent have so many blobs."""

SIGMA_OF_SHARE = 0.52
"""A blob's sigma in parts of its share of the bone: a little over half, as in the default body."""

GREY = [0.5, 0.5, 0.5]

_SIDE = re.compile(r"[Ll]eft|[Rr]ight|LEFT|RIGHT|^[lrLR](?=[A-Z_.])|(?<=[_.])[lrLR]$")


def attach_blobs(rows: SkeletonRows) -> None:
    """Add blobs along all bones, and the groups in which lengths and sizes are scaled: left and right together."""
    extent = rows.extent()
    group_of = {joint: name for name, members in rows.shape.items() for joint in members.get("joint_offsets", [])}
    for joint, end, below in _bones(rows):
        length = float(np.linalg.norm(end))
        if length <= 1e-6 * extent:
            continue
        count = next(number for part, number in BLOBS_OF_BONES if length > part * extent)
        label = f"{joint}_end" if below is None else f"{below}_bone"
        names = [f"{label}{k + 1}" for k in range(count)]
        for k, name in enumerate(names):
            offset = (end * (k + 0.5) / count).tolist()
            sigma = SIGMA_OF_SHARE * length / count
            rows.blobs.append({"name": name, "joint": joint, "offset": offset, "sigma": sigma, "color": GREY})
        both_sides = _SIDE.sub("", label).strip("_. ")
        if below is None or below not in group_of:
            rows.add_to_group(f"{both_sides}_length", joint_offsets=[below] if below else [], blob_offsets=names)
        else:
            rows.add_to_group(group_of[below], blob_offsets=names)
        rows.add_to_group(f"{both_sides}_size", blob_sigmas=names)


def _bones(rows: SkeletonRows) -> Iterator[tuple[str, Float[np.ndarray, "3"], str | None]]:
    """The joint that carries a bone, the bone's end from there, and the joint at that end, if there is one."""
    for row in rows.joints:
        if row["parent"] != WORLD:
            yield row["parent"], np.array(row["offset"], float), row["name"]
    for joint, end in rows.ends.items():
        yield joint, np.array(end, float), None
