"""The colours of an adjusted actor, measured again from frames of the clip; kept where they explain more."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import tee

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from sogjax.io.frame_table import FrameTable
from sogjax.model.body import Body
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.refine.clip_programs import term_values
from sogjax.refine.clip_shape import frames_by_spread
from sogjax.refine.pictures import NearPairs, Reader
from sogjax.run.frames import limb_rows, with_rivals
from sogjax.run.setup import Setup
from sogjax.tracking.frame import FrameInput
from sogjax.tracking.frame_by_frame import confidence_of_poses
from sogjax.tracking.tracker import Tracker

NUM_FRAMES = 6
"""Frames from which colours are taken: as many as there are example poses, and some more."""
MORE_DOUBT = 0.02
"""About a limb, on average over the frames, that new colours may cause."""
REACH = 60
"""Frames among which they are chosen, in the middle of a long clip: full pictures are read up to the last one."""


def color_rows(
    body: Body, poses: Float[np.ndarray, "frame dof"], similarity: Float[np.ndarray, "frame"]
) -> Int[np.ndarray, "chosen"]:
    """The frames whose colours are measured."""
    first = max((len(poses) - REACH) // 2, 0)
    part = slice(first, first + REACH)
    return first + frames_by_spread(body.skeleton, poses[part], similarity[part], NUM_FRAMES)


def mean_similarity(tracker: Tracker, cells: list[FrameInput], poses: Float[np.ndarray, "chosen dof"]) -> float:
    """The mean similarity of the tracker's body in some frames."""
    shape = cells[0].cells.shape[1:3]
    pictures = Reader.from_tracker(tracker, (int(shape[0]), int(shape[1]))).pictures(cells, poses)
    at = jnp.asarray(poses, jnp.float32)
    pairs = NearPairs.of(tracker, tracker.body, pictures, at, 0)
    return float(jnp.mean(term_values(tracker.body, tracker.terms, pictures.views, pairs.pairs, at)["similarity"]))


def judged_with_colors(
    setup: Setup, body: Body, frames: Iterable[FrameInput], table: FrameTable
) -> tuple[Setup, FrameTable]:
    """The setup with a body of new colours, unless these make a limb more doubtful, and what is thought of the limbs.

    Args:
        setup: of the adjusted body.
        body: with new colours, or the same.
        frames: of the table, read once.
        table: the adjusted frames.
    """
    setups = [setup]
    if body is not setup.bodies[0]:
        setups.append(replace(setup, bodies=(body,), tracker=replace(setup.tracker, body=body)))
    parts = zip(setups, tee(frames, len(setups)), strict=True)
    each = [confidence_of_poses(one.tracker, table.pose, part) for one, part in parts]
    found: list[list[LimbConfidence]] = [[] for _ in setups]
    for frame in zip(*each, strict=True):  # frame by frame, so that cells need not be kept
        for confidences, confidence in zip(found, frame, strict=True):
            confidences.append(confidence)
    judged = [replace(table, limb_unlike=None, **limb_rows(of_one)) if of_one else table for of_one in found]
    told = [with_rivals(one, table.limb_rival) for one in judged]
    chosen = 0 if more_doubtful(told[-1], told[0]) else -1
    return setups[chosen], told[chosen]


def more_doubtful(table: FrameTable, than: FrameTable) -> bool:
    """Whether a limb, as it is seen, is in doubt more than the most doubtful one of another table, on average."""
    doubt = lambda one: 0.0 if one.seen_doubt is None else float(np.max(np.mean(one.seen_doubt, axis=0), initial=0.0))
    return doubt(table) > doubt(than) + MORE_DOUBT
