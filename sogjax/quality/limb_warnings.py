"""Stretches of a motion in which a limb is in doubt.

Joints that are bent as far as they can be: nobody stands so for long, but what is not seen ends up there. Of turns that
a body's spheres do not tell, that says nothing.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool

from sogjax.io.motion import Motion
from sogjax.model.body import Body
from sogjax.model.reach import told_dofs
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.metrics import stretches

AT_LEAST, GAP = 4, 3
"""Frames: shorter stretches are not reported, and shorter gaps between doubts do not count."""
HIDDEN = 0.7
"""Part of a limb, mean over a stretch, whose being hidden is the cause of the doubt."""


@dataclass(frozen=True)
class DoubtfulLimb:
    """A limb and the frames over which it is in doubt."""

    name: str
    first_frame: int
    last_frame: int
    doubt: float
    """Mean over the stretch: how likely the limb is more than 10 cm off."""
    hidden: bool = False
    """Whether it is in doubt since things in front hide it."""
    elsewhere: bool = False
    """Whether it is only in doubt since another way to hold it explains about as much."""

    def __str__(self) -> str:
        frames = f"frames {self.first_frame} to {self.last_frame}"
        if self.hidden:
            return f"{self.name} hidden by what stands in front in {frames}"
        also = ", might as well be elsewhere" if self.elsewhere else ""
        return f"{self.name} doubtful in {frames} ({100.0 * self.doubt:.0f} % likely more than 10 cm off{also})"


def in_doubt(motion: Motion, bound: float | None = None) -> Bool[np.ndarray, "frame limb"]:
    """Which limbs are in doubt in which frames; none where they were not judged.

    `bound` is how likely lost they must be; None: `limb_doubtful` of the fitted numbers, or `doubtful` of those of
    rivals where it is known what these gain and the limb is not mostly hidden.
    """
    if motion.limb_doubt is None:
        return np.zeros((motion.num_frames, 0), bool)
    numbers = fitted_numbers()
    has_rivals = np.zeros_like(motion.limb_doubt, bool) if motion.limb_rival is None else np.isfinite(motion.limb_rival)
    if motion.limb_hidden is not None:
        has_rivals &= motion.limb_hidden <= HIDDEN
    bounds = np.where(has_rivals, numbers.rivals.doubtful, numbers.verdict.limb_doubtful)
    return motion.limb_doubt > (bounds if bound is None else bound)


def doubtful_limbs(motion: Motion, bound: float | None = None, at_least: int = AT_LEAST) -> tuple[DoubtfulLimb, ...]:
    """All stretches of `at_least` so many frames, by their first frames; `bound` as in `in_doubt`."""
    if motion.limb_doubt is None or motion.limb_names is None:
        return ()
    doubted, rivalled, found = in_doubt(motion, bound), _rivalled(motion, bound), []
    hidden = np.zeros_like(motion.limb_doubt) if motion.limb_hidden is None else motion.limb_hidden
    for limb, name in enumerate(motion.limb_names):
        for first, stop in stretches(doubted[:, limb], at_least, gap=GAP):
            doubt, unseen = (float(of[first:stop, limb].mean()) for of in (motion.limb_doubt, hidden))
            frames = int(motion.frame[first]), int(motion.frame[stop - 1])
            mostly = rivalled[first:stop, limb].sum() > MOSTLY * doubted[first:stop, limb].sum()
            causes = unseen > HIDDEN, bool(mostly) and unseen <= HIDDEN
            found.append(DoubtfulLimb(str(name), *frames, doubt, *causes))
    return tuple(sorted(found, key=lambda limb: (limb.first_frame, limb.name)))


def _rivalled(motion: Motion, bound: float | None) -> Bool[np.ndarray, "frame limb"]:
    """Which limbs are only in doubt since they have rivals."""
    doubted = in_doubt(motion, bound)
    if motion.limb_unlike is None or motion.limb_rival is None:
        return np.zeros_like(doubted)
    alone = in_doubt(replace(motion, limb_doubt=motion.limb_unlike, limb_rival=None), bound)
    return doubted & ~alone & np.isfinite(motion.limb_rival)


AT_LIMIT = 0.03
"""Part of its range by which a joint is at most away from its limit."""
BENT = 0.4
"""Radians between that limit and the rest pose: straight knees and elbows are at theirs."""
MOSTLY = 0.5
"""Share of the frames."""


class Limits(NamedTuple):
    """The bounds of a degree of freedom, and its value in the rest pose (radians or metres)."""

    low: float
    high: float
    rest: float


def limits_of(body: Body) -> dict[str, Limits]:
    """The limits of the degrees of freedom that a body's blobs tell, by name; infinite where there is no limit."""
    skeleton = body.skeleton
    columns = (skeleton.dof_lower, skeleton.dof_upper, body.poses["rest"])
    rows = zip(*(np.asarray(column, float).tolist() for column in columns), strict=True)
    named = zip(skeleton.dof_names, rows, told_dofs(body).tolist(), strict=True)
    return {name: Limits(*row) for name, row, told in named if told}


def joints_at_limits(motion: Motion, limits: Mapping[str, Limits]) -> dict[str, float]:
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
