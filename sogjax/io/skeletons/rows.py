"""A skeleton as read from a file: the tables of a body file, not yet checked, with blobs along bones that have none."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.io.actor_rows import WORLD

MAX_ROWS = 2000
"""How many one-axis joints a file may have, and how many markers, groups and degrees of freedom."""

Row = dict[str, Any]


@dataclass
class SkeletonRows:
    """Joints, and what hangs on them; all lengths in one unit, angles in radians."""

    name: str
    joints: list[Row] = field(default_factory=list)
    dofs: list[Row] = field(default_factory=list)
    blobs: list[Row] = field(default_factory=list)
    landmarks: list[Row] = field(default_factory=list)
    shape: dict[str, dict[str, list[str]]] = field(default_factory=dict)
    """What is scaled together, by name of the group, as in a body file."""
    ends: dict[str, list[float]] = field(default_factory=dict)
    """Where the bone of a joint without children ends, from the joint."""

    def add_joint(self, name: str, parent: str, offset: list[float], axis: list[float] | str, kind: str) -> None:
        """Append a one-axis joint; the parent of a root is `world`."""
        self.joints.append({"name": name, "parent": parent, "offset": offset, "axis": axis, "kind": kind})

    def add_to_group(self, name: str, **members: list[str]) -> None:
        """Scale more lengths or sizes together with a group, which is made where it is new."""
        group = self.shape.setdefault(name, {})
        for key, names in members.items():
            group.setdefault(key, []).extend(names)

    def document(self) -> dict[str, Any]:
        """The content of a body file, without its unit."""
        return {
            "name": self.name,
            "joints": self.joints,
            "dofs": self.dofs,
            "blobs": self.blobs,
            "landmarks": self.landmarks,
            "shape": [{"name": name} | members for name, members in self.shape.items()],
            "poses": {"rest": {}},
        }

    def extent(self) -> float:
        """The longest side of the box around the joints and ends in the rest pose, in which no frame is turned."""
        rows = {row["name"]: row for row in self.joints}
        places: dict[str, Float[np.ndarray, 3]] = {WORLD: np.zeros(3)}
        for start in rows:
            branch = [start]
            while branch[-1] in rows and branch[-1] not in places and len(branch) <= len(rows):
                branch.append(rows[branch[-1]]["parent"])
            for name in reversed(branch[:-1] if branch[-1] in places else []):
                places[name] = places[rows[name]["parent"]] + np.array(rows[name]["offset"], float)
        points = [place for name, place in places.items() if name != WORLD]
        points += [places[joint] + end for joint, end in self.ends.items() if joint in places]
        return float(np.ptp(np.array(points).reshape(-1, 3), axis=0).max()) if points else 0.0


GREY = [0.5, 0.5, 0.5]

_SIDE = re.compile(r"[Ll]eft|[Rr]ight|LEFT|RIGHT|^[lrLR](?=[A-Z_.])|(?<=[_.])[lrLR]$")


def attach_blobs(rows: SkeletonRows) -> None:
    """Add blobs along all bones, and the groups in which lengths and sizes are scaled: left and right together.

    Along every bone, from a joint to a child elsewhere or to the bone's end, lie four grey blobs, two where the bone is
    shorter than a tenth of the skeleton, one below a twenty-fifth: a start, which the actor's pictures then scale. They
    share the bone evenly, and their sigma is a little over half of such a share, as in the default body, so that
    neighbours touch where each counts as body.
    """
    extent = rows.extent()
    group_of = {joint: name for name, members in rows.shape.items() for joint in members.get("joint_offsets", [])}
    for joint, end, below in _bones(rows):
        length = float(np.linalg.norm(end))
        if length <= 1e-6 * extent:
            continue
        count = 4 if length > 0.1 * extent else 2 if length > 0.04 * extent else 1
        label = f"{joint}_end" if below is None else f"{below}_bone"
        names = [f"{label}{k + 1}" for k in range(count)]
        for k, name in enumerate(names):
            offset = (end * (k + 0.5) / count).tolist()
            sigma = 0.52 * length / count
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
