"""The times that a motion and another system have in common: the offset of the clocks, and values at other times."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Bool, Float

from sogjax.errors import InputError
from sogjax.io.motion import Motion
from sogjax.io.reference.reference_motion import ReferenceMotion
from sogjax.quality.reference.names import Points
from sogjax.quality.reference.time_offset import LEAST_CORRELATION, time_offset


def check_time(motion: Motion, reference: ReferenceMotion, offset: float) -> None:
    """Check that the two overlap once `offset` seconds are added to the other system's times.

    Raises:
        InputError: they do not.
    """
    if reference.time[-1] + offset < motion.time[0] or reference.time[0] + offset > motion.time[-1]:
        first, last = reference.time[0] + offset, reference.time[-1] + offset
        raise InputError(
            f"{reference.path}: has no time in common with the motion, which lasts from {motion.time[0]:.2f} to "
            f"{motion.time[-1]:.2f} s (its own is {first:.2f} to {last:.2f} s); give offset=SECONDS to add to it"
        )


def common_rows(
    motion: Motion, reference: ReferenceMotion, offset: float, theirs: Sequence[np.ndarray]
) -> Bool[np.ndarray, "frame"]:
    """The motion's frames for which any of the other system's values is known.

    Raises:
        InputError: fewer than two.
    """
    rows = np.any([np.isfinite(values.reshape(len(values), -1)).all(axis=-1) for values in theirs], axis=0)
    if rows.sum() < 2:
        check_time(motion, reference, offset)
        raise InputError(
            f"{reference.path}: has values in fewer than two frames of the motion, of what both know; give one with "
            "fewer gaps, or offset=SECONDS to add to its times"
        )
    return np.asarray(rows)


def found_offset(
    pairs: list[tuple[np.ndarray, np.ndarray]], our_time: np.ndarray, their_time: np.ndarray
) -> tuple[float, str]:
    """The offset by cross-correlation, and what is said of it."""
    pairs = [pair for pair in pairs if all(np.isfinite(each).sum() > 2 for each in pair)]
    found, alike = (
        time_offset([a for a, _ in pairs], our_time, [b for _, b in pairs], their_time) if pairs else (0.0, 0.0)
    )
    if alike < LEAST_CORRELATION:
        return 0.0, f"no time offset was found (correlation {alike:.2f}): times were taken as they are; or give offset="
    return found, f"its times were shifted by {found:+.3f} s, found by cross-correlation ({alike:.3f})"


def distances(
    ours: Points, theirs: Mapping[str, Float[np.ndarray, "other 3"]], names: Mapping[str, str]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Distances of pairs of points from each other, which do not depend on the world; ours and theirs.

    With one point it is its height.
    """
    if len(names) < 2:
        return [(ours[our][:, 1], theirs[name][:, 1]) for name, our in names.items()]
    first, *others = names
    apart = lambda points, one, other: np.linalg.norm(points[one] - points[other], axis=-1)
    chain = zip([first, *others], [*others, first], strict=True)
    skipped = zip([first, *others], [*others[1:], first, *others[:1]], strict=True)
    return [
        (apart(ours, names[one], names[other]), apart(theirs, one, other))
        for one, other in (*chain, *skipped)
        if one != other
    ]


def at_times(
    reference: ReferenceMotion, values: Float[np.ndarray, "other *value"], time: Float[np.ndarray, "frame"]
) -> Float[np.ndarray, "frame *value"]:
    """Values at other times of its clock, linearly between frames; NaN outside and where a neighbour is not known."""
    flat = values.reshape(len(values), -1)
    rounding = 1e-3 / reference.fps  # times in files have six digits
    inside = (time >= reference.time[0] - rounding) & (time <= reference.time[-1] + rounding)
    at = np.stack([np.where(inside, np.interp(time, reference.time, column), np.nan) for column in flat.T], axis=-1)
    return at.reshape(len(time), *values.shape[1:])


def resampled(motion: Motion, reference: ReferenceMotion) -> list[str]:
    """What is said where the two have different frame rates."""
    rate = 1.0 / float(np.median(np.diff(motion.time))) if motion.num_frames > 1 else motion.fps
    if abs(reference.fps / rate - 1.0) <= 1e-3:
        return []
    return [f"its {reference.fps:.4g} frames per second were resampled to the motion's {rate:.4g}"]
