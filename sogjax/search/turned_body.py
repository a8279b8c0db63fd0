"""Whole actors the other way round, in a few frames of a clip.

Back and front look much alike. A body that is followed back to front stays so, since no step leads out of it. What
tells are feet, faces and bent knees, most of it while the actor moves.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sogjax.model.body import Body
from sogjax.search.body_parts import Part
from sogjax.search.limb_search import FEW, WORTH, LimbSearch
from sogjax.search.mirrored import limb_pairs, look_alikes
from sogjax.search.other_pass import Pass
from sogjax.tracking.frame import AnyFrame, on_device

FEWEST_FRAMES, FRAMES_APART = 3, 60
"""Frames of a clip in which actors are turned, at least; and how far apart they are in long clips, at most."""
PROMISING = -0.01
"""Part of a frame's energy: what a turned actor is worth more, climbed, for its limbs to be searched, too."""
WHOLE = 1.0
"""Part of the solver's most iterations that a turned actor is climbed by."""


def turned_rows(num_rows: int) -> list[int]:
    """The frames of a clip in which actors are turned; none at its ends, where they may not have moved yet."""
    count = max(FEWEST_FRAMES, -(-num_rows // FRAMES_APART))
    return sorted({int((k + 0.5) * num_rows / count) for k in range(count)})


def turned(body: Body, whole: Part, pose: Float[np.ndarray, "dof"]) -> Float[np.ndarray, "other dof"]:
    """A pose with an actor the other way round: with all its sides exchanged, and with all but one pair of limbs."""
    others, actors = look_alikes(body, pose), body.blob_actors
    own = [k for k, pair in enumerate(limb_pairs(body)) if actors[pair[0]] == actors[whole.blobs][0]]
    chosen = [0, *(2 * k + 2 for k in own)] if own else []
    found = np.tile(pose, (len(chosen), 1))
    found[:, whole.dofs] = others[chosen][:, whole.dofs]
    return found


def turned_pose(
    search: LimbSearch, wholes: Sequence[Part], frame: AnyFrame, passed: Pass, row: int
) -> Float[np.ndarray, "dof"] | None:
    """The pose of a frame with an actor the other way round and its limbs held as fits then, if that is worth more."""
    known, best = passed.poses[row], WORTH * passed.energy
    views, found = search.views(on_device(frame), known, passed.capacities), None
    for whole in wholes:
        others = turned(search.tracker.body, whole, known)
        if not len(others):
            continue
        ends, gains = search.climbed(views, known, others, np.full(len(others), FEW))
        likeliest = int(np.argmax(gains))
        ends, gains = search.climbed(views, known, ends[likeliest : likeliest + 1], np.array([WHOLE]))
        if gains[0] < PROMISING * passed.energy:
            continue
        pose = search.with_better_limbs(views, known, ends[0], passed.energy)
        gain = float(search.climbed(views, known, pose[None], np.array([FEW]))[1][0])
        if gain > best and search.possible(known, pose[None])[0]:
            found, best = pose, gain
    return found
