"""Whole actors back to front, in a few frames of a clip.

Back and front look much alike. A body that is followed back to front stays so, since no step leads out of it. What
tells are feet, faces and bent knees, most of it while the actor moves.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sogjax.model.body import Body
from sogjax.search.body_parts import Part
from sogjax.search.climbed import FEW
from sogjax.search.limb_search import WORTH, LimbSearch
from sogjax.search.mirrored import limb_pairs, look_alikes
from sogjax.search.other_pass import Pass
from sogjax.tracking.frame import AnyFrame, on_device

PROMISING = -0.01
"""Part of a frame's energy that a turned actor may be worth less, climbed, for its limbs to be searched, too: those of
the other side cost about as much."""
WHOLE = 1.0
"""Part of the solver's most iterations that a turned actor is climbed by."""


def turned(
    body: Body, whole: Part, pose: Float[np.ndarray, "dof"], others: Float[np.ndarray, "other dof"]
) -> Float[np.ndarray, "way dof"]:
    """A pose with one actor back to front: with all its sides exchanged, and with all but one pair of limbs.

    `others` are the `look_alikes` of the pose; of a body without sides there are none.
    """
    actors = body.blob_actors
    own = [k for k, pair in enumerate(limb_pairs(body)) if actors[pair[0]] == actors[whole.blobs][0]]
    chosen = [0, *(2 * k + 2 for k in own)] if own and len(others) else []
    found = np.tile(pose, (len(chosen), 1))
    found[:, whole.dofs] = others[chosen][:, whole.dofs]
    return found


def turned_pose(
    search: LimbSearch, wholes: Sequence[Part], frame: AnyFrame, passed: Pass, row: int
) -> Float[np.ndarray, "dof"] | None:
    """The pose of a frame with an actor back to front and its limbs held as fits then, if that is worth more."""
    known, best = passed.poses[row], WORTH * passed.energy
    views, found = search.views(on_device(frame), known), None
    others = look_alikes(search.tracker.body, known)
    for whole in wholes:
        ways = turned(search.tracker.body, whole, known, others)
        if not len(ways):
            continue
        ends, gains = search.climbed(views, known, ways, np.full(len(ways), FEW))
        likeliest = int(np.argmax(gains))
        ends, gains = search.climbed(views, known, ends[likeliest : likeliest + 1], np.array([WHOLE]))
        if gains[0] < PROMISING * passed.energy:
            continue
        pose = search.with_better_limbs(views, known, ends[0], passed.energy).pose
        gain = float(search.climbed(views, known, pose[None], np.array([FEW]))[1][0])
        if gain > best and search.possible(known, pose[None])[0]:
            found, best = pose, gain
    return found
