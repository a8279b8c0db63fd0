"""Joints that are bent as far as they can be: nobody stands so for long, but what is not seen ends up there."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from sogjax.data.motion import Motion
from sogjax.model.body import Body

AT_LIMIT = 0.03
"""Part of its range by which a joint is at most away from its limit."""
BENT = 0.4
"""Radians between that limit and the rest pose: straight knees and elbows are at theirs."""
MOSTLY = 0.5
"""Share of the frames."""


class Limits(NamedTuple):
    """Of a degree of freedom: the smallest and largest value, and that of the rest pose (radians or metres)."""

    low: float
    high: float
    rest: float


def limits_of(body: Body) -> dict[str, Limits]:
    """Of a body's degrees of freedom, by name; infinite where there is no limit."""
    skeleton = body.skeleton
    columns = (skeleton.dof_lower, skeleton.dof_upper, body.poses["rest"])
    rows = zip(*(np.asarray(column, float).tolist() for column in columns), strict=True)
    return {name: Limits(*row) for name, row in zip(skeleton.dof_names, rows, strict=True)}


def strained_joints(motion: Motion, limits: Mapping[str, Limits]) -> dict[str, float]:
    """The degrees of freedom that are at a limit in most frames, and in what share of them."""
    found = {}
    for name, values in zip(motion.dof_names.tolist(), np.asarray(motion.pose).T, strict=True):
        limit = limits.get(name)
        if limit is None or not np.isfinite(limit).all():
            continue
        near = AT_LIMIT * (limit.high - limit.low)
        low = float(np.mean(values < limit.low + near)) if limit.rest - limit.low > BENT else 0.0
        high = float(np.mean(values > limit.high - near)) if limit.high - limit.rest > BENT else 0.0
        if max(low, high) > MOSTLY:
            found[name] = max(low, high)
    return found
