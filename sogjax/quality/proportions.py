"""Whether the bones of an actor are as long beside each other as those of the body it was made from.

Silhouettes do not tell where hips and shoulders turn: a body with legs that are too long and a trunk that is too short
covers them as well.
"""

from collections.abc import Mapping

import numpy as np

from sogjax.io.actor_file import ADULT, bundled_like
from sogjax.model.body import Body
from sogjax.model.bones import WIDTHS, bone_lengths
from sogjax.quality.fitted import fitted_numbers

FEWEST = 3
"""Long bones from which the size of a body is told."""
LONG = 0.5
"""Bones of the starting body that have this part of its longest one's length at least are compared."""


def odd_bones(body: Body, start: Body | None = None) -> dict[str, float]:
    """How many times as long as they should be bones are, for the size of the whole body: those that are odd.

    `start` is the body that the actor was made from; None: the one with its joints that comes with the package, or else
    nothing is odd. The size of the whole is the median over the long bones, so a bone that is wrong hardly moves it.
    """
    ratios = _ratios(start or bundled_like(body), body)
    if len(ratios) < FEWEST:
        return {}
    whole = float(np.median([*ratios.values()]))
    bound = fitted_numbers().proportions.most_odd
    return _sides_together({name: r / whole for name, r in ratios.items() if abs(np.log(r / whole)) > bound})


def odd_size(body: Body) -> float | None:
    """How many times as long as an adult's the bones of a human are, if they are odd."""
    like = bundled_like(body)
    size = size_beside(like, body) if like is not None and like.name == ADULT else None
    bounds = fitted_numbers().proportions
    return None if size is None or bounds.least_size <= size <= bounds.most_size else size


def size_beside(like: Body, body: Body) -> float | None:
    """How many times as long as another body's the bones of a body are; None: they cannot be compared."""
    ratios = _ratios(like, body)
    return float(np.median([*ratios.values()])) if len(ratios) >= FEWEST else None


def odd_sentence(body: Body, start: Body | None = None) -> str | None:
    """What is odd about an actor's bones, with the remedy; None: nothing."""
    said = [sentence for sentence in (_size_sentence(body), _bones_sentence(body, start)) if sentence is not None]
    return "; ".join(said) or None


def _size_sentence(body: Body) -> str | None:
    size = odd_size(body)
    if size is None:
        return None
    several = "its masks show more than one person (with actors=2, each gets an actor)"
    masks = "its masks show only a part of somebody" if size < 1.0 else several
    return (
        f"its bones are {size:.0%} as long as an adult's: if that is not so, {masks}, or the calibration's unit is "
        "wrong; look at the masks in the actor's report, and correct them or give pictures of the empty scene"
    )


def _bones_sentence(body: Body, start: Body | None) -> str | None:
    odd = odd_bones(body, start)
    if not odd:
        return None
    shown = ", ".join(
        f"{name} {abs(factor - 1.0):.0%} too {'long' if factor > 1.0 else 'short'}" for name, factor in odd.items()
    )
    return (
        f"the body's proportions are odd ({shown} beside its other bones; people differ by 5 %), however well its "
        "silhouettes agree: joints are in the wrong places; make it of example poses in which knees and elbows are "
        "bent, or correct masks that end too early or too late"
    )


def _ratios(like: Body | None, body: Body) -> dict[str, float]:
    """How many times as long as those of another body the long bones are, by name; none if there is no other one."""
    if like is None:
        return {}
    before, after = bone_lengths(like), bone_lengths(body)
    bones = {name: length for name, length in before.items() if name not in WIDTHS and name in after}
    shortest = LONG * max(bones.values(), default=0.0)
    return {name: max(after[name], 1e-6) / length for name, length in bones.items() if length >= shortest > 0.0}


def _sides_together(odd: Mapping[str, float]) -> dict[str, float]:
    """Left and right bones that are both odd in one way under one name, with their mean."""
    found: dict[str, float] = {}
    for name, factor in odd.items():
        side, _, bone = name.partition(" ")
        other = odd.get(f"{({'left': 'right', 'right': 'left'}).get(side)} {bone}")
        if other is not None and (other > 1.0) == (factor > 1.0):
            found[bone] = 0.5 * (factor + other)
        else:
            found[name] = factor
    return found
