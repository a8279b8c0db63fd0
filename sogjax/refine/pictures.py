"""What the pictures of a clip say near the poses that were tracked: read once, kept while they are adjusted."""

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, UInt8

from sogjax.energy.appearance import BlobClusters, ColorWindows
from sogjax.energy.pairs import SparsePairs
from sogjax.energy.similarity import similarity_among
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.model.camera import project
from sogjax.model.program import compiled
from sogjax.refine.camera_moves import Sights
from sogjax.scene.cells import inside_pictures
from sogjax.scene.color_clusters import SLOTS, SPARE, ColorClusters, odds_where_told
from sogjax.tracking.capacity import first_capacities, larger_capacities
from sogjax.tracking.culling import BLOCK_STEP, Capacities, block_capacity, body_boxes
from sogjax.tracking.frame import AnyFrame, FrameInput, TrackState, on_device
from sogjax.tracking.tracker import Tracker

COLUMNS, ROWS = 40, 64
"""Cells of a window; those of a standing person are 3 cm wide."""
BORDER = 0.08
"""Around a body's box, as a part of its size: adjusted poses stay near those that were tracked."""
BLOCK_HEADROOM = 1.1
USUAL_BLOBS = 2048
"""Image blobs of a picture."""


class ClipPictures(eqx.Module):
    """The pictures of some frames; the first axis of every array counts them."""

    views: Views
    windows: ColorWindows
    clusters: BlobClusters = eqx.field()
    """The clusters, which have no axis of frames."""

    @property
    def num_frames(self) -> int:
        """How many."""
        return self.windows.x.shape[0]


class Reader(eqx.Module):
    """Makes the pictures of a clip from cells, for one body."""

    tracker: Tracker
    clusters: ColorClusters = eqx.field(static=True)
    inside: Float[np.ndarray, "camera rows columns"]
    """1 for the cells of a picture, 0 for padding."""

    @classmethod
    def from_tracker(cls, tracker: Tracker, shape: tuple[int, int]) -> "Reader":
        """A reader for cells of so many rows and columns."""
        inside = inside_pictures(tracker.reader.candidates.grids, shape)
        return cls(tracker, ColorClusters.from_body(tracker.body), inside)

    def pictures(self, cells: Sequence[AnyFrame], poses: Float[np.ndarray, "frame dof"]) -> ClipPictures:
        """The pictures of frames, near the poses in them.

        Raises:
            InputError: more image blobs than the largest capacity.
        """
        tables = jnp.asarray(self.clusters.tables, jnp.float32)
        states = [TrackState.from_pose(jnp.asarray(pose, jnp.float32)) for pose in poses]
        capacities = first_capacities(self.tracker, states[0], on_device(cells[0]))
        found: list[Views] = []
        windows = []
        while len(found) < len(states):
            frame, state = on_device(cells[len(found)]), states[len(found)]
            views, near, matching = _views(self.tracker, frame, state, capacities)
            counts = int(jnp.max(near)), int(jnp.max(matching))
            if not capacities.hold(*counts):
                capacities = larger_capacities(capacities, *counts, 0)
                found = []  # all frames have the same room, so that one program serves them
                continue
            found.append(views)
        for frame, state in zip(map(on_device, cells), states, strict=True):
            present = jnp.ones(len(self.inside), bool) if frame.present is None else frame.present
            shown = jnp.where(present[:, None, None], self.inside, 0.0)
            windows.append(_windows(self.tracker, jnp.asarray(frame.cells), shown, tables, state.previous))
        stack = lambda *leaves: jnp.stack(leaves)
        clusters = BlobClusters.from_members(self.clusters.members, SLOTS)
        return ClipPictures(jax.tree.map(stack, *found), jax.tree.map(stack, *windows), clusters)


def bytes_of_frame(cameras: int, num_blobs: int) -> int:
    """About how much memory the pictures of a frame take."""
    clusters = -(-num_blobs // SLOTS) + SPARE
    return 4 * cameras * (num_blobs * USUAL_BLOBS + COLUMNS * ROWS * clusters)


class NearPairs(eqx.Module):
    """The pairs of blobs that matter near some poses of all frames."""

    pairs: SparsePairs
    capacity: int = eqx.field(static=True)

    @classmethod
    def of(
        cls,
        tracker: Tracker,
        body: Body,
        pictures: ClipPictures,
        poses: Float[Array, "frame dof"],
        capacity: int,
        sights: Sights | None = None,
    ) -> "NearPairs":
        """The pairs, at least `capacity` blocks in each frame; `sights` has a velocity of each frame's blobs."""
        exponent = similarity_among(tracker.terms).exponent
        while True:
            pairs, count = _pairs(body, pictures.views, poses, exponent, max(capacity, BLOCK_STEP), sights)
            most = int(jnp.max(count))
            if most <= capacity:
                return cls(pairs, capacity)
            capacity = block_capacity(most, BLOCK_HEADROOM)


@compiled
def _views(
    tracker: Tracker,
    frame: FrameInput,
    state: TrackState,
    capacities: Capacities,
) -> tuple[Views, Int[Array, "camera"], Int[Array, "camera"]]:
    return tracker.views(frame, state, capacities)


@compiled
def _pairs(
    body: Body,
    views: Views,
    poses: Float[Array, "frame dof"],
    exponent: Float[Array, ""],
    capacity: int,
    sights: Sights | None,
) -> tuple[SparsePairs, Int[Array, "frame"]]:
    def one(frame: tuple[Views, Array, Array | None]) -> tuple[SparsePairs, Int[Array, ""]]:
        seen_by, pose, velocities = frame
        blobs, cameras = body.posed_blobs(pose), seen_by.cameras
        if sights is None or velocities is None:
            seen = jax.vmap(project, in_axes=(0, None))(cameras, blobs)
        else:
            seen = Sights(sights.moves, velocities).seen(cameras, blobs)
        return seen_by.near_seen(seen, exponent, capacity)

    return jax.lax.map(one, (views, poses, None if sights is None else sights.velocities))


@compiled
def _windows(
    tracker: Tracker,
    cells: UInt8[Array, "camera rows columns 3"],
    inside: Float[Array, "camera rows columns"],
    tables: Float[Array, "cluster bin bin bin"],
    pose: Float[Array, "dof"],
) -> ColorWindows:
    """Grids around a body: what each cluster of blobs would explain there."""
    cameras, body = tracker.cameras, tracker.body
    odds = odds_where_told(cells.astype(tables.dtype) / 255.0, inside, tracker.reader.background, tables)
    around = jax.vmap(body_boxes, in_axes=(None, 0, None, None))
    boxes = around(body.posed_blobs(pose), cameras, body.blob_actors, jnp.asarray(BORDER, pose.dtype))[:, 0]
    real = jnp.all(jnp.isfinite(boxes), axis=(1, 2))
    boxes = jnp.where(real[:, None, None], boxes, jnp.array([[[0.0, 0.0], [1.0, 1.0]]], boxes.dtype))
    sizes = tracker.reader.cell_sizes
    windows = ColorWindows.in_boxes(odds, sizes, cameras, boxes, (COLUMNS, ROWS))
    return replace(windows, free=jnp.where(real[:, None, None], windows.free, 0.0))
