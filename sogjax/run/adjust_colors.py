"""The colours of an adjusted actor, measured again from frames of the clip; kept where they explain more."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from sogjax.actor.colors import ColoredView, back_projected_colors, camera_of, colored
from sogjax.io.recording import Recording
from sogjax.io.video import read_frames
from sogjax.model.body import Body
from sogjax.refine.clip_programs import term_values
from sogjax.refine.clip_shape import frames_by_spread
from sogjax.refine.pictures import NearPairs, Reader
from sogjax.tracking.frame import FrameInput
from sogjax.tracking.tracker import Tracker

NUM_FRAMES = 6
"""From which colours are taken: as many as there are example poses, and some more."""
REACH = 60
"""Frames among which they are chosen, in the middle of a long clip: full pictures are read up to the last one."""


def color_rows(
    body: Body, poses: Float[np.ndarray, "frame dof"], similarity: Float[np.ndarray, "frame"]
) -> Int[np.ndarray, "chosen"]:
    """The frames whose colours are measured."""
    first = max((len(poses) - REACH) // 2, 0)
    part = slice(first, first + REACH)
    return first + frames_by_spread(body.skeleton, poses[part], similarity[part], NUM_FRAMES)


def measured_colors(
    recording: Recording, body: Body, frames: list[int], poses: Float[np.ndarray, "chosen dof"], space: str
) -> Body:
    """The body with the colours that the pictures of some frames show.

    Args:
        recording: whose pictures are read.
        body: upright in the recording's world.
        frames: counted from the recording's first, increasing.
        poses: in those frames.
        space: in which colours are averaged.

    Raises:
        InputError: a picture cannot be read.
    """
    rig = jax.tree.map(jnp.asarray, recording.rig.cameras)
    of_frame = dict(zip(frames, poses, strict=True))
    views = [
        ColoredView(camera_of(rig, k), image, None, jnp.asarray(of_frame[frame], jnp.float32))
        for frame, images in enumerate(read_frames(recording, frames[0], frames[-1] + 1), frames[0])
        if frame in of_frame
        for k, image in enumerate(images)
        if image is not None
    ]
    return colored(body, back_projected_colors(body, views, space))


def mean_similarity(tracker: Tracker, cells: list[FrameInput], poses: Float[np.ndarray, "chosen dof"]) -> float:
    """Of the tracker's body in some frames."""
    shape = cells[0].cells.shape[1:3]
    pictures = Reader.from_tracker(tracker, (int(shape[0]), int(shape[1]))).pictures(cells, poses)
    at = jnp.asarray(poses, jnp.float32)
    pairs = NearPairs.of(tracker, tracker.body, pictures, at, 0)
    return float(jnp.mean(term_values(tracker.body, tracker.terms, pictures.views, pairs.pairs, at)["similarity"]))
