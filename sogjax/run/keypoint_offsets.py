"""Where the detector of a clip puts its keypoints on the actors: told by its first frames, before it is tracked."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.energy.keypoint_views import SeenKeypoints
from sogjax.energy.keypoints import KeypointTerm, keypoint_term_among
from sogjax.run.clip_keypoints import ClipKeypoints
from sogjax.run.job import Job
from sogjax.run.pipeline import PictureReader, Preparation, frame_input
from sogjax.run.terminal import progress, say
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.keypoint_bias import estimated_offsets
from sogjax.tracking.tracker import Tracker

FRAMES, FEWEST = 48, 10
"""Of a clip that tell the offsets, at most and at least."""
LITTLE = 0.15
"""Of the keypoints' weight, while the pictures are to tell where the body is."""


def told_offsets(job: Job, read: PictureReader) -> Tracker:
    """The job's tracker, knowing where the detector puts its keypoints; the same where there are none.

    The first frames are tracked with little weight on the keypoints: what these are off on average is the detector's
    manner (or the body's), which is not to pull.

    Raises:
        InputError: a video cannot be read, or a picture has too many image blobs.
    """
    first, count = job.begin, min(FRAMES, job.frames[1] - job.begin)
    pull = keypoint_term_among(job.tracker.terms)
    if job.keypoints is None or pull is None or count < FEWEST or len(job.grids) < 2:
        return job.tracker
    lightly = eqx.tree_at(lambda p: p.weight, pull, LITTLE * pull.weight)
    pictures = read(job.recording, Preparation(job.grids), first, first + count)
    cells = (frame_input([picture.cells for picture in frame]) for frame in pictures)
    shown = progress(cells, count, "tracking, to learn the keypoints' places")
    frames = job.with_keypoints(shown, range(first, first + count))
    tracked = track(with_pull(job.tracker, lightly), job.start, frames)
    poses = np.stack([np.asarray(done.result.pose) for done in tracked])
    return knowing_offsets(job.tracker, job.keypoints, first + np.arange(count), poses)


def knowing_offsets(
    tracker: Tracker,
    keypoints: ClipKeypoints,
    frames: Int[np.ndarray, "frame"],
    poses: Float[np.ndarray, "frame dof"],
) -> Tracker:
    """The tracker with the offsets that frames with known poses tell; `frames` counts from the recording's first."""
    pull = keypoint_term_among(tracker.terms)
    assert pull is not None
    seen = SeenKeypoints(keypoints.seen.pixels[frames], keypoints.seen.confidence[frames])
    seen, poses_there = jax.tree.map(jnp.asarray, seen), jnp.asarray(poses, tracker.normalizers.dtype)
    offsets = estimated_offsets(pull, tracker.body, tracker.cameras, tracker.normalizers, poses_there, seen)
    _say_what(offsets)
    return with_pull(tracker, eqx.tree_at(lambda p: p.offsets, pull, offsets))


def with_pull(tracker: Tracker, pull: KeypointTerm) -> Tracker:
    """The tracker with another pull of the keypoints."""
    terms = tuple(pull if isinstance(term, KeypointTerm) else term for term in tracker.terms)
    return eqx.tree_at(lambda t: t.terms, tracker, terms)


def _say_what(offsets: Float[Array, "actor keypoint 3"]) -> None:
    lengths = 1e3 * np.linalg.norm(np.asarray(offsets, float), axis=-1)
    told = lengths[lengths > 0.0]
    if len(told):
        say(f"keypoints lie {told.mean():.0f} mm from the landmarks on average, at most {told.max():.0f} mm")
