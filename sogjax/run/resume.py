"""A tracker that resumes where another process stopped."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.model.sog import Sog
from sogjax.run.pipeline import FrameTracker
from sogjax.run.prefix import Prefix
from sogjax.tracking.frame import FrameInput, TrackedFrame, TrackState, on_device
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.scan import image_blobs
from sogjax.tracking.tracker import Tracker

Frames = Iterable[FrameInput]


def resumed(prefix: Prefix, shown: bool, with_images: bool) -> FrameTracker:
    """Tracks the frames after a prefix; replaces a tracker of the whole clip.

    Args:
        prefix: the frames that were already tracked.
        shown: whether the frames given begin with those of the prefix, which outputs show with the poses found.
        with_images: whether to compute their image blobs again.
    """

    def follow(tracker: Tracker, start: Float[Array, "dof"], frames: Frames) -> Iterator[TrackedFrame]:
        coming = iter(frames)
        if shown:
            yield from _again(prefix, tracker, start, islice(coming, prefix.num_frames), with_images)
        for tracked in track(tracker, prefix.state(start), coming, prefix.capacities):
            yield replace(tracked, index=prefix.num_frames + tracked.index)

    return follow


def frames_of(prefix: Prefix, tracker: Tracker) -> Iterator[TrackedFrame]:
    """The frames of a prefix without their image blobs."""
    for index in range(prefix.num_frames):
        result = prefix.result(index, _no_blobs(len(tracker.normalizers)))
        yield TrackedFrame(index, result, prefix.capacities, tracker.reader.color_space, 0.0)


def _again(
    prefix: Prefix, tracker: Tracker, start: Float[Array, "dof"], frames: Frames, with_images: bool
) -> Iterator[TrackedFrame]:
    """The frames of a prefix, without tracking them."""
    state, capacities = TrackState.from_pose(start), prefix.capacities
    for index, frame in enumerate(frames):
        known = on_device(frame)
        images = image_blobs(tracker, state, known, capacities) if with_images else _no_blobs(len(known.cells))
        result = prefix.result(index, images)
        yield TrackedFrame(index, result, capacities, tracker.reader.color_space, 0.0)
        state = state.advanced(result.pose)


def _no_blobs(cameras: int) -> Sog:
    none = jnp.zeros((cameras, 0))
    return Sog(jnp.zeros((cameras, 0, 2)), none, jnp.zeros((cameras, 0, 3)), none.astype(bool))
