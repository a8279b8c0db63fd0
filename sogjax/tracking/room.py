"""Room for image blobs outside a tracking step: what needs more is computed again."""

from collections.abc import Callable
from typing import TypeVar

import jax
from jaxtyping import Array, Int

from sogjax.tracking.culling import Capacities
from sogjax.tracking.tracker import larger_capacities

Found = TypeVar("Found")

Needed = tuple[Int[Array, ""], Int[Array, ""]]
"""Image blobs of one camera, near and matching, at most: what capacities must hold."""


def with_room(compute: Callable[[Capacities], tuple[Found, Needed]], capacities: Capacities) -> Found:
    """What is computed with these capacities, or larger ones if it needs them: no blob is cut off unseen.

    Raises:
        InputError: more image blobs than the largest capacity.
    """
    while True:
        found, needed = compute(capacities)
        near, matching = (int(count) for count in jax.device_get(needed))
        if capacities.hold(near, matching):
            return found
        capacities = larger_capacities(capacities, near, matching, 0)
