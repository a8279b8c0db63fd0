"""Lengths of a body's bones, from one distinct joint to the next."""

from dataclasses import dataclass, field

import numpy as np

from sogjax.model.body import Body
from sogjax.model.compiled import compiled_hastily
from sogjax.model.skeleton import Skeleton

SAME_PLACE = 1e-4
"""Metres. One-axis joints nearer than this to their parent make one joint with it."""
ALONG = 0.99
"""Cosine above which an axis lies along a bone: a roll joint in the middle of a bone does not end it."""

COMMON_NAMES = {
    ("shoulder", "elbow"): "upper arm",
    ("elbow", "wrist"): "forearm",
    ("hip", "knee"): "thigh",
    ("knee", "ankle"): "shank",
}
WIDTHS = {"shoulder width": "shoulder", "hip width": "hip"}
_world_from_joint = compiled_hastily(Skeleton.world_from_joint)


@dataclass
class _Place:
    """One-axis joints at one point."""

    joints: list[int]
    parent: int | None
    length: float
    """Metres from the parent's place."""
    children: list[int] = field(default_factory=list)
    name: str = ""


def bone_lengths(body: Body) -> dict[str, float]:
    """Length of every bone in metres by name: `left upper arm`, or `A - B` where there is no common name.

    A chain of places that are numbered alike, such as spine1 to spine5, counts as one bone. The widths between left
    and right shoulders and hips (in the rest pose) come last.
    """
    places = _places(body)
    lengths: dict[str, float] = {}
    for k, place in enumerate(places):
        if place.parent is None or _passes_through(body, places, k):
            continue
        length, top = place.length, place.parent
        while _passes_through(body, places, top):
            above = places[top].parent
            if above is None:
                break
            length, top = length + places[top].length, above
        lengths[_bone_name(places[top].name, place.name)] = length
    return lengths | _widths(body, places)


def turning_places(body: Body) -> list[tuple[str, list[int]]]:
    """Where one bone turns against another: a name, and the one-axis joints at that place; roots are left out."""
    places = _places(body)
    ends = [k for k, place in enumerate(places) if place.parent is not None and not _passes_through(body, places, k)]
    return [(places[k].name, places[k].joints) for k in ends]


def _places(body: Body) -> list[_Place]:
    skeleton = body.skeleton
    offsets = np.linalg.norm(np.asarray(skeleton.offsets, float), axis=1)
    places: list[_Place] = []
    place_of: dict[int, int] = {}
    for joint, parent in enumerate(skeleton.parents):
        if parent >= 0 and offsets[joint] < SAME_PLACE:
            place_of[joint] = place_of[parent]
            places[place_of[joint]].joints.append(joint)
            continue
        above = place_of[parent] if parent >= 0 else None
        place_of[joint] = len(places)
        if above is not None:
            places[above].children.append(len(places))
        places.append(_Place([joint], above, float(offsets[joint])))
    for place in places:
        place.name = _common_name([skeleton.names[joint] for joint in place.joints])
    return places


def _passes_through(body: Body, places: list[_Place], k: int) -> bool:
    """A bone does not end here: only a roll about it, or one of a numbered row."""
    place = places[k]
    if place.parent is None or len(place.children) != 1:
        return False
    child = places[place.children[0]]
    row = _base(place.name)
    if row == _base(places[place.parent].name) == _base(child.name):
        return True
    direction = np.asarray(body.skeleton.offsets, float)[child.joints[0]]
    axes = np.asarray(body.skeleton.axes, float)[place.joints]
    return bool((np.abs(axes @ direction) > ALONG * np.linalg.norm(direction)).all())


def _base(name: str) -> str:
    """The name without a number at its end."""
    return name.rstrip("0123456789")


def _common_name(names: list[str]) -> str:
    """The words that the names begin with: left_hip of left_hip_bend and left_hip_side."""
    words = [name.split("_") for name in names]
    common = []
    for parts in zip(*words, strict=False):
        if len(set(parts)) > 1:
            break
        common.append(parts[0])
    return "_".join(common) or names[0]


def _bone_name(top: str, end: str) -> str:
    if _base(top) == _base(end):
        return _base(top).replace("_", " ")
    side, _, rest = end.partition("_")
    if side in ("left", "right") and top.startswith(side + "_"):
        common = COMMON_NAMES.get((top[len(side) + 1 :], rest))
        if common is not None:
            return f"{side} {common}"
    return f"{top} - {end}".replace("_", " ")


def _widths(body: Body, places: list[_Place]) -> dict[str, float]:
    frames = np.asarray(_world_from_joint(body.skeleton, body.poses["rest"]), float)
    at = {place.name: frames[place.joints[0], :3, 3] for place in places}
    return {
        width: float(np.linalg.norm(at[f"left_{part}"] - at[f"right_{part}"]))
        for width, part in WIDTHS.items()
        if f"left_{part}" in at and f"right_{part}" in at
    }
