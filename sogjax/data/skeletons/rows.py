"""A skeleton as read from a file: the tables of a body file, not yet checked, in the units of the file."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.data.actor_rows import WORLD

MAX_ROWS = 2000
"""One-axis joints, markers, groups and degrees of freedom of a file, each."""

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
    """By name of a group what is scaled together, as in a body file."""
    ends: dict[str, list[float]] = field(default_factory=dict)
    """By joint without children: where its bone ends, from the joint."""

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
