"""Two bones whose ends are given: where the joint between them is, and how they turn."""

import numpy as np
from jaxtyping import Float

Vectors = Float[np.ndarray, "frame 3"]


def middle_joint(start: Vectors, near: Vectors, end: Vectors, lengths: tuple[float, float]) -> Vectors:
    """The place that is `lengths` away from `start` and `end`, on the side of `near`.

    Where the ends are too far apart it is on the line between them, and the second bone does not reach.
    """
    upper, lower = lengths
    along = end - start
    apart = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-9)
    along = along / apart
    forward = np.clip((upper**2 - lower**2 + apart**2) / (2.0 * apart), -upper, upper)
    aside = near - start
    aside = aside - (aside * along).sum(axis=-1, keepdims=True) * along
    aside = aside / np.maximum(np.linalg.norm(aside, axis=-1, keepdims=True), 1e-9)
    return start + forward * along + np.sqrt(np.maximum(upper**2 - forward**2, 0.0)) * aside


def shortest_turns(before: Vectors, after: Vectors) -> Float[np.ndarray, "frame 3 3"]:
    """The smallest rotations that turn one direction to the other; for opposite ones none."""
    one, other = (each / np.maximum(np.linalg.norm(each, axis=-1, keepdims=True), 1e-9) for each in (before, after))
    axis, cosine = np.cross(one, other), (one * other).sum(axis=-1)
    crossed = np.zeros((len(axis), 3, 3))
    crossed[:, [2, 0, 1], [1, 2, 0]] = axis
    crossed -= crossed.swapaxes(-1, -2)
    safe = np.maximum(1.0 + cosine, 1e-9)
    return np.eye(3) + crossed + crossed @ crossed / safe[:, None, None]
