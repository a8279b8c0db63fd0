"""The pass that searches limbs over the clip and tracks backwards around doubts; parts come from what explains more."""

from collections.abc import Iterable, Mapping
from functools import partial

import numpy as np
from jaxtyping import Bool, Float

from sogjax.errors import InputError, counted
from sogjax.io.frame_table import TERM, FramesRecord, FrameTable
from sogjax.model.limbs import limb_blobs
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.jumps import NEAR, largest_step
from sogjax.quality.verdict import NEARLY_ALL, expected_of
from sogjax.run.frames import capacities_of, with_rivals
from sogjax.run.setup import Setup
from sogjax.run.terminal import alive, say
from sogjax.search.merge_passes import merge_passes
from sogjax.search.misplaced import Misplaced
from sogjax.search.other_pass import Pass
from sogjax.search.revision import Revised
from sogjax.tracking.frame import FrameInput


class Merged(FramesRecord):
    """The frames with what other passes explain better."""

    file = "merged.npz"


def merge_backward(setup: Setup, tracked: FrameTable, known: Float[np.ndarray, "frame dof"] | None = None) -> Merged:
    """The frames with what other passes explain better; as they are where nothing is, or a pass failed.

    That a pass failed is said. `known` are the poses of a pass that is there already, if one is.
    """
    if tracked.limb_doubt is None or tracked.baseline is None:
        return Merged(tracked)
    energies, capacities = np.asarray(tracked.energy, float), capacities_of(tracked, row=None)
    passed = Pass(tracked.pose, tracked.limb_doubt, tracked.baseline, energies, capacities)
    numbers = setup.clip.numbers

    def of_rows(rows: range) -> Iterable[FrameInput]:
        """What is seen in some rows."""
        first, step = numbers[rows.start], rows.step * numbers.step
        return setup.clip.frames(first, first + len(rows) * step, step)

    try:
        with alive("searching limbs over the clip") as work:
            keys = key_rows(len(numbers), setup.clip.fps)
            turning = turning_rows(len(numbers), setup.clip.fps)
            report = partial(setattr, work, "share")
            elsewhere, jump = misplaced(setup, tracked), NEAR * largest_step(setup.clip.fps)
            found = merge_passes(setup.tracker, passed, of_rows, keys, turning, elsewhere, report, jump, known)
    except InputError as error:
        say(f"warning: limbs were not searched over the clip, which stays as it was tracked: {error}")
        return Merged(tracked)
    merged = tracked.with_rows(found.frames, [*map(_columns, found.frames.values())])
    merged = with_rivals(merged, over_frames(found.rivals, len(merged)))
    if not found.frames:
        return Merged(merged)
    parts = ", ".join(f"{name} ({len(rows)})" for name, rows in sorted(found.parts.items()))
    say(f"taken from other passes in {counted(len(found.frames), 'frame')}: {parts}")
    return Merged(merged)


KEY_SECONDS = 0.15
"""Seconds between frames in which limbs are searched."""


def key_rows(num_rows: int, fps: float) -> range:
    """The frames of a clip in which limbs are searched."""
    return range(0, num_rows, max(round(KEY_SECONDS * fps), 1))


FEWEST_TURNED, TURNED_SECONDS = 3, 2.0
"""Frames of a clip in which actors are turned back to front, at least, and the time between them, at most: in one frame
an actor may not move, and then little tells; each costs about half a second."""


def turning_rows(num_rows: int, fps: float) -> list[int]:
    """The frames in which actors are turned: the middles of equal parts of the clip."""
    count = max(FEWEST_TURNED, int(np.ceil(num_rows / (TURNED_SECONDS * fps))))
    return sorted({int((k + 0.5) * num_rows / count) for k in range(count)})


def misplaced(setup: Setup, tracked: FrameTable) -> Misplaced | None:
    """The search for actors who seem to be somebody else where they are tracked; None: nothing tells."""
    if tracked.explained is None:
        return None
    bounds, expected = fitted_numbers().verdict, expected_of(setup.bodies)
    least = [
        bounds.other_subject * expected[body.name] if body.name in expected else bounds.least_explained
        for body in setup.bodies
    ]
    explained = np.where(unseen(setup, tracked), np.inf, np.asarray(tracked.explained, float))
    return Misplaced(setup.tracker, setup.bodies, setup.clip.recording.up, explained, np.array(least))


def unseen(setup: Setup, tracked: FrameTable) -> Bool[np.ndarray, "frame actor"]:
    """Where nothing tells who an actor is: he is out of all views, or nearly all of him is hidden by things."""
    assert tracked.explained is not None
    found, body = np.asarray(tracked.explained) == 0.0, setup.tracker.body
    if tracked.limb_hidden is None or not tracked.limb_hidden.size:
        return found
    actors = np.array([body.blob_actors[blobs][0] if blobs.any() else -1 for blobs in limb_blobs(body)])
    for actor in range(found.shape[1]):
        hidden = np.asarray(tracked.limb_hidden)[:, actors == actor]
        found[:, actor] |= hidden.min(axis=1, initial=1.0) >= NEARLY_ALL if hidden.size else False
    return found


def over_frames(rivals: Mapping[int, Float[np.ndarray, "limb"]], count: int) -> Float[np.ndarray, "frame limb"] | None:
    """What rivals gain in every frame, interpolated between the key frames in which that is known; None: nowhere."""
    if not rivals:
        return None
    known = np.stack([*rivals.values()])
    return np.stack([np.interp(np.arange(count), [*rivals], of_limb) for of_limb in known.T], axis=1)


def _columns(revised: Revised) -> dict[str, object]:
    """What is known of a revised frame, by the names of columns; the baseline stays that of the first pass."""
    return {
        "pose": revised.pose,
        "energy": revised.energy,
        "limb_doubt": revised.judged.error_probability,
        "explained": revised.judged.explained,
        "overlap": revised.judged.overlap,
        **({} if revised.judged.hidden is None else {"limb_hidden": revised.judged.hidden}),
        **{TERM + name: value for name, value in revised.terms.items()},
    }
