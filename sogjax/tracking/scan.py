"""A whole clip as one compiled call: the tracker's step in a `lax.scan` over the cells of all frames.

The tracker frame by frame (`sogjax.tracking.frame_by_frame.track`) gives the same numbers; this one does no work
between frames.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt8

from sogjax.model.sog import Sog
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import NOTHING, Beside, FrameResult, TrackState
from sogjax.tracking.room import first_capacities, larger_capacities
from sogjax.tracking.tracker import Tracker

ClipCells = UInt8[Array, "frame camera rows columns 3"]


def scanned(tracker: Tracker, start: Float[Array, "dof"], cells: ClipCells, capacities: Capacities) -> FrameResult:
    """The results of all frames of a clip, stacked, tracked with fixed capacities.

    Whether these sufficed is for the caller to see in the counts. Image blobs are left out.
    """

    def one_frame(state: TrackState, frame: UInt8[Array, "camera rows columns 3"]) -> tuple[TrackState, FrameResult]:
        state, result = tracker.step(state, frame, capacities)
        return state, without_images(result)

    return jax.lax.scan(one_frame, tracker.start(start), cells)[1]


def without_images(result: FrameResult) -> FrameResult:
    """The result of a frame with no image blobs in it, which nobody wants to keep for a whole clip."""
    images = result.images
    none = Sog(images.means[..., :0, :], images.sigmas[..., :0], images.colors[..., :0, :], images.mask[..., :0])
    return eqx.tree_at(lambda r: r.images, result, none)


_scanned = eqx.filter_jit(scanned)


def track_clip(
    tracker: Tracker, start: Float[Array, "dof"], cells: UInt8[np.ndarray, "frame camera rows columns 3"] | ClipCells
) -> tuple[FrameResult, Capacities]:
    """The results of all frames of a clip, stacked, from one compiled call, and the capacities that sufficed.

    Capacities are those of the frame-by-frame tracker; where a frame needs more, the whole clip is tracked again with
    larger ones, so no blob is ever cut off unseen.

    Raises:
        InputError: more image blobs than the largest capacity.
    """
    on_device = jnp.asarray(cells)
    capacities = first_capacities(tracker, TrackState.from_pose(start), on_device[0])
    while True:
        result = _scanned(tracker, start, on_device, capacities)
        counts = jax.device_get((result.num_near, result.num_matching, result.num_blocks))
        needed = [int(count.max()) for count in counts]
        if capacities.hold(*needed):
            return result, capacities
        capacities = larger_capacities(capacities, *needed)


@eqx.filter_jit
def image_blobs(
    tracker: Tracker,
    state: TrackState,
    cells: UInt8[Array, "camera rows columns 3"],
    capacities: Capacities,
    beside: Beside = NOTHING,
) -> Sog:
    """The image blobs of a frame that was tracked already."""
    return tracker.views(cells, tracker.led(state, beside), capacities, beside)[0].images
