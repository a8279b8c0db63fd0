"""Some of many points, spread over all of them."""

import numpy as np
from jaxtyping import Float, Int


def farthest(points: Float[np.ndarray, "point dim"], count: int, first: int = 0) -> Int[np.ndarray, "chosen"]:
    """Rows of at most `count` different points, in their order: the first, then what is farthest from all before."""
    if len(points) <= count:
        return np.arange(len(points))
    chosen, distance = [first], np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < count and distance.max() > 0.0:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.sort(chosen)
