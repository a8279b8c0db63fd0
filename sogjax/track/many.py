"""Many runs at once: trackers that differ in numbers only track one clip in a single compiled call."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, UInt8

from sogjax.energy.similarity import similarity_among
from sogjax.energy.views import Views
from sogjax.track.culling import Capacities, in_boxes
from sogjax.track.frame import FrameResult, TrackState
from sogjax.track.scan import ClipCells, with_room, without_images
from sogjax.track.tracker import Tracker, first_capacities

Batching = Literal["one_by_one", "in_step"]
"""How the solver works through the members of a frame: one after the other, or all iterations in step."""

AXIS = "member"
Seen = tuple[Views, Int[Array, "camera"], Int[Array, "camera"]]


class Members(eqx.Module):
    """Trackers that differ in numbers only: those numbers stacked, everything else once."""

    swept: Tracker
    """The arrays in which the members differ, stacked; None in place of all others."""
    shared: Tracker
    """The arrays in which they do not."""

    @classmethod
    def from_trackers(cls, trackers: Sequence[Tracker]) -> "Members":
        """The members of a sweep.

        Raises:
            ValueError: they differ in more than numbers, which one program cannot serve.
        """
        first = trackers[0]
        for tracker in trackers[1:]:
            if not same_program(first, tracker):
                raise ValueError("trackers that differ in more than the values of their arrays cannot run in one call")
        swept = jax.tree.map(lambda *leaves: not _all_equal(leaves), *trackers)
        stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *trackers)
        return cls(eqx.filter(stacked, swept), eqx.filter(first, swept, inverse=True))

    def of(self, swept: Tracker) -> Tracker:
        """One member, from its own numbers."""
        return eqx.combine(swept, self.shared)


def same_program(a: Tracker, b: Tracker) -> bool:
    """Whether one compiled program serves both: they differ in the values of arrays only."""
    if jax.tree.structure(a) != jax.tree.structure(b):
        return False
    alike = lambda x, y: x.shape == y.shape and x.dtype == y.dtype
    return all(map(alike, jax.tree.leaves(a), jax.tree.leaves(b)))


def track_many(
    trackers: Sequence[Tracker],
    starts: Float[Array, "member dof"],
    cells: UInt8[np.ndarray, "frame camera rows columns 3"] | ClipCells,
    batching: Batching = "one_by_one",
    common_boxes: bool = True,
) -> tuple[FrameResult, Capacities]:
    """Track one clip with every tracker: stacked results (frame, member), and the capacities that sufficed.

    What no swept number enters is computed once a frame: the quad-trees, and with `common_boxes` also which image
    blobs are near the bodies of all members and of their colours, of which each member takes those in its own boxes. So
    sums have other zeros in between; without common boxes the numbers are to the bit those of trackers run one by one.

    Raises:
        ValueError: the trackers differ in more than numbers.
        InputError: more image blobs than the largest capacity.
    """
    together = AXIS if common_boxes else None
    trackers = [replace(tracker, together=together) for tracker in trackers]
    members, on_device = Members.from_trackers(trackers), jnp.asarray(cells)
    first = _common_capacities([replace(tracker, together=None) for tracker in trackers], starts, on_device[0])
    return with_room(lambda capacities: _tracked(members, starts, on_device, capacities, batching), first)


@eqx.filter_jit
def _tracked(
    members: Members, starts: Float[Array, "member dof"], cells: ClipCells, capacities: Capacities, batching: Batching
) -> FrameResult:
    def found(swept: Tracker, shared: Tracker, state: TrackState, seen: Seen) -> tuple[TrackState, FrameResult]:
        state, result = eqx.combine(swept, shared).found(state, seen, capacities)
        return state, without_images(result)

    each_found = found if batching == "in_step" else jax.custom_batching.sequential_vmap(found)

    def one_member(swept: Tracker, state: TrackState, frame: Array) -> tuple[TrackState, FrameResult]:
        tracker = members.of(swept)
        seen = tracker.views(frame, state, capacities)
        return each_found(swept, members.shared, state, in_own_boxes(tracker, state, seen))

    def one_frame(states: TrackState, frame: Array) -> tuple[TrackState, FrameResult]:
        return jax.vmap(one_member, in_axes=(0, 0, None), axis_name=AXIS)(members.swept, states, frame)

    return jax.lax.scan(one_frame, jax.vmap(TrackState.from_pose)(starts), cells)[1]


def in_own_boxes(tracker: Tracker, state: TrackState, seen: Seen) -> Seen:
    """What a tracker sees through common boxes, without the image blobs that are not in its own."""
    if tracker.together is None:
        return seen
    views, *counts = seen
    images = views.images
    own = in_boxes(images, replace(tracker, together=None).boxes(state))
    return eqx.tree_at(lambda v: v.images.mask, views, images.mask & own), counts[0], counts[1]


def member(results: FrameResult, index: int) -> FrameResult:
    """The clip of one of several trackers."""
    return jax.tree.map(lambda leaf: leaf[:, index], results)


def _common_capacities(
    trackers: Sequence[Tracker], starts: Float[Array, "member dof"], cells: UInt8[Array, "camera rows columns 3"]
) -> Capacities:
    """Room for what every member needs in the first frame; members that see the same there are looked at once."""
    looked: list[tuple[Tracker, Array]] = []
    found = []
    for tracker, start in zip(trackers, starts, strict=True):
        if any(_sees_the_same(tracker, start, *other) for other in looked):
            continue
        looked.append((tracker, start))
        found.append(first_capacities(tracker, TrackState.from_pose(start), cells))
    return Capacities(*(max(getattr(c, name) for c in found) for name in ("near", "matching", "blocks")))


def _sees_the_same(a: Tracker, start_a: Array, b: Tracker, start_b: Array) -> bool:
    """Whether two trackers keep the same image blobs and pairs in the first frame."""
    looks = lambda tracker, start: jax.tree.leaves((tracker.reader, similarity_among(tracker.terms).exponent, start))
    return all(_all_equal(pair) for pair in zip(looks(a, start_a), looks(b, start_b), strict=True))


def _all_equal(leaves: Sequence[Array]) -> bool:
    return all(leaf is leaves[0] or bool(np.array_equal(leaf, leaves[0])) for leaf in leaves[1:])
