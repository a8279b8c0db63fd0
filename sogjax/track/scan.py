"""A whole clip as one compiled call: the tracker's step in a `lax.scan` over the cells of all frames.

The frame-by-frame tracker (`sogjax.track.tracker.track`) gives the same numbers; this one has no work between frames,
and can be mapped over settings (`sogjax.track.many`).
"""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt8

from sogjax.energy.objective import EnergyTerms
from sogjax.track.culling import Capacities
from sogjax.track.tracker import FrameResult, Tracker, TrackState, first_capacities, larger_capacities

ClipCells = UInt8[Array, "frame camera rows columns 3"]


class ClipResult(eqx.Module):
    """What was found in the frames of a clip: a `FrameResult` without its image blobs, frame by frame."""

    poses: Float[Array, "frame *member dof"]
    terms: EnergyTerms
    """Their leading axes are those of the poses."""
    iterations: Int[Array, "frame *member"]
    converged: Bool[Array, "frame *member"]
    num_near: Int[Array, "frame *member camera"]
    num_matching: Int[Array, "frame *member camera"]
    num_blocks: Int[Array, "frame *member"]

    @classmethod
    def from_frames(cls, results: FrameResult) -> "ClipResult":
        """From the stacked results of all frames."""
        return cls(
            poses=results.pose,
            terms=results.terms,
            iterations=results.iterations,
            converged=results.converged,
            num_near=results.num_near,
            num_matching=results.num_matching,
            num_blocks=results.num_blocks,
        )

    def needed(self) -> tuple[int, int, int]:
        """The most image blobs near the body, matching ones, and blocks of pairs in any frame."""
        counts = jax.device_get((self.num_near, self.num_matching, self.num_blocks))
        near, matching, blocks = (int(count.max()) for count in counts)
        return near, matching, blocks

    def member(self, index: int) -> "ClipResult":
        """One of several trackers."""
        return jax.tree.map(lambda leaf: leaf[:, index], self)


def scanned(tracker: Tracker, start: Float[Array, "dof"], cells: ClipCells, capacities: Capacities) -> ClipResult:
    """Track a clip with fixed capacities; whether they sufficed is for the caller to see in the counts."""

    def one_frame(state: TrackState, frame: UInt8[Array, "camera rows columns 3"]) -> tuple[TrackState, FrameResult]:
        state, result = tracker.step(state, frame, capacities)
        return state, without_images(result)

    _, results = jax.lax.scan(one_frame, TrackState.from_pose(start), cells)
    return ClipResult.from_frames(results)


def without_images(result: FrameResult) -> FrameResult:
    """The result of a frame without its image blobs, which nobody wants to keep for a whole clip."""
    return eqx.tree_at(lambda r: r.images, result, None)


_scanned = eqx.filter_jit(scanned)


def track_clip(
    tracker: Tracker, start: Float[Array, "dof"], cells: UInt8[np.ndarray, "frame camera rows columns 3"] | ClipCells
) -> tuple[ClipResult, Capacities]:
    """Track all frames of a clip in one compiled call, and the capacities that sufficed.

    Capacities are those of the frame-by-frame tracker; where a frame needs more, the whole clip is tracked again with
    larger ones, so no blob is ever cut off unseen.

    Raises:
        InputError: more image blobs than the largest capacity.
    """
    on_device = jnp.asarray(cells)
    first = first_capacities(tracker, TrackState.from_pose(start), on_device[0])
    return with_room(lambda capacities: _scanned(tracker, start, on_device, capacities), first)


def with_room(tracked: Callable[[Capacities], ClipResult], capacities: Capacities) -> tuple[ClipResult, Capacities]:
    """A clip tracked with ever larger capacities until nothing was cut off.

    Raises:
        InputError: more image blobs than the largest capacity.
    """
    while True:
        result = tracked(capacities)
        needed = result.needed()
        if capacities.hold(*needed):
            return result, capacities
        capacities = larger_capacities(capacities, *needed)
