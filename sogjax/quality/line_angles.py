"""Angles between the lines that join joints, which places of joints tell without any axes."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

_BETWEEN = {
    "hip": ("{}_shoulder", "{}_hip", "{}_knee"),
    "knee": ("{}_hip", "{}_knee", "{}_ankle"),
    "ankle": ("{}_knee", "{}_ankle", "{}_toe"),
    "shoulder": ("{}_hip", "{}_shoulder", "{}_elbow"),
    "elbow": ("{}_shoulder", "{}_elbow", "{}_wrist"),
}
"""Angles between the lines from a joint to two others, which files of points tell."""


def angles_between(points: Mapping[str, Float[np.ndarray, "frame 3"]]) -> dict[str, Float[np.ndarray, "frame"]]:
    """Angles in degrees between the lines from a joint to two others, for the joints that are known."""
    angles = {}
    for side in ("left", "right"):
        for joint, three in _BETWEEN.items():
            names = [each.format(side) for each in three]
            if all(name in points for name in names):
                above, at, below = (points[name] for name in names)
                one, other = above - at, below - at
                aside = np.linalg.norm(np.cross(one, other), axis=-1)
                angles[f"{joint}_{side[0]}"] = np.degrees(np.arctan2(aside, (one * other).sum(axis=-1)))
    return angles
