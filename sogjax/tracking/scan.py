"""A whole clip as one compiled call: the tracker's step in a `lax.scan` over the cells of all frames.

The tracker frame by frame (`sogjax.tracking.frame_by_frame.track`) gives the same numbers; this one does no work
between frames.
"""

import equinox as eqx
from jaxtyping import Array, UInt8

from sogjax.model.sog import Sog
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, FrameResult, TrackState
from sogjax.tracking.tracker import Tracker

ClipCells = UInt8[Array, "frame camera rows columns 3"]


def without_images(result: FrameResult) -> FrameResult:
    """The result of a frame with no image blobs in it, which nobody wants to keep for a whole clip."""
    images = result.images
    none = Sog(images.means[..., :0, :], images.sigmas[..., :0], images.colors[..., :0, :], images.mask[..., :0])
    return eqx.tree_at(lambda r: r.images, result, none)


@eqx.filter_jit
def image_blobs(tracker: Tracker, state: TrackState, frame: FrameInput, capacities: Capacities) -> Sog:
    """The image blobs of a frame that was tracked already."""
    return tracker.views(frame, tracker.led(state, frame), capacities)[0].images
