"""Limbs that a motion holds inside each other, or in the trunk, for longer than they may pass: one of them is wrong.

Both may show their own colours, as legs behind a table that were exchanged do, so that no evidence doubts them.
"""

import numpy as np
from jaxtyping import Float

from sogjax.io.motion import Motion
from sogjax.model.body import Body
from sogjax.model.limbs import limb_blobs, limb_names
from sogjax.model.solid import Solid
from sogjax.quality.metrics import stretches

DEEP = 0.06
"""Metres deeper than in any named pose: folded arms are up to 0.05, and an arm that swings by 0.09 for an instant."""
LASTING = 0.25
"""Seconds for which they are."""


def passages(body: Body, motion: Motion) -> list[str]:
    """What to look at, one sentence for each stretch and pair of parts, by their first frames."""
    solid, pose = Solid.of(body), np.asarray(motion.pose, np.float32)
    if not solid.pairs.size:
        return []
    least = max(round(LASTING * float(motion.fps)), 2)
    found: dict[tuple[int, int, str], None] = {}
    for names, deep in _by_parts(body, solid, solid.deeper(body, np.asarray(body.poses["rest"]), pose)).items():
        for first, stop in stretches(deep > DEEP, least, gap=2):
            found[int(motion.frame[first]), int(motion.frame[stop - 1]), names] = None
    return [f"look at frames {first}-{last}, {names}" for first, last, names in sorted(found)]


def _by_parts(
    body: Body, solid: Solid, deeper: Float[np.ndarray, "frame pair"]
) -> dict[str, Float[np.ndarray, "frame"]]:
    """The deepest of all capsules of each pair of parts, in metres, by what to say of them."""
    members, limbs, ends = limb_blobs(body), limb_names(body), np.asarray(solid.ends)[:, 0]
    part = lambda capsule: next((limbs[k] for k in np.flatnonzero(members[:, ends[capsule]])), "the trunk")
    deepest: dict[str, np.ndarray] = {}
    for pair, column in zip(np.asarray(solid.pairs).tolist(), deeper.T, strict=True):
        if column.max(initial=0.0) > DEEP:
            one, two = sorted((part(pair[0]), part(pair[1])), key=lambda name: (name == "the trunk", name))
            name = f"{one} through {two}"
            deepest[name] = np.maximum(deepest.get(name, np.zeros(len(column))), column)
    return deepest
