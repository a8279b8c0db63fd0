"""Angles that can be compared: counted the same way, and between bones where only points are known."""

import numpy as np
from jaxtyping import Bool, Float

from sogjax.quality.reference.names import Columns, Points

_BETWEEN = {
    "hip": ("{}_shoulder", "{}_hip", "{}_knee"),
    "knee": ("{}_hip", "{}_knee", "{}_ankle"),
    "ankle": ("{}_knee", "{}_ankle", "{}_toe"),
    "shoulder": ("{}_hip", "{}_shoulder", "{}_elbow"),
    "elbow": ("{}_shoulder", "{}_elbow", "{}_wrist"),
}
"""Angles between the lines from a joint to two others, which files of points tell."""
_OTHER_WAY = -0.8
"""Correlation below which an angle is taken to be counted the other way."""


def same_way(
    ours: Columns, theirs: Columns, rows: Bool[np.ndarray, "frame"]
) -> tuple[dict[str, Float[np.ndarray, "frame"]], list[str]]:
    """Their angles, those that are counted the other way turned round, and what is said of these."""
    turned, said = dict(theirs), []
    for name, values in theirs.items():
        a, b = ours[name][rows], values[rows]
        known = np.isfinite(b)
        moves = known.sum() > 2 and min(np.ptp(a[known]), np.ptp(b[known])) > 1.0
        if moves and np.corrcoef(a[known], b[known])[0, 1] < _OTHER_WAY:
            turned[name] = -values
            said.append(f"{name} is counted the other way in the truth and was turned round")
    return turned, said


def angles_between(points: Points) -> dict[str, Float[np.ndarray, "frame"]]:
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
