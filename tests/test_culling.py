"""Which image blobs are kept: culling must not be seen in the energy."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body, shipped
from drawn_scene import cells_of, draw, in_colors, make_tracker, standing
from hypothesis import given
from hypothesis import strategies as st
from rig_cases import ring_rig

from sogjax.energy.similarity import similarity_among
from sogjax.energy.views import Views
from sogjax.errors import InputError
from sogjax.model.body import concatenate
from sogjax.model.camera import project
from sogjax.model.color import from_rgb
from sogjax.model.sog import Sog
from sogjax.scene.background import BackgroundCells
from sogjax.scene.foreground import BackgroundModel
from sogjax.scene.quadtree import keep_blobs
from sogjax.tracking.culling import (
    BLOB_RADIUS,
    BLOCK_STEP,
    CAPACITIES,
    Capacities,
    block_capacity,
    body_boxes,
    capacity_for,
    union_boxes,
)
from sogjax.tracking.frame import FrameInput, TrackState

CULLED = 2e-3
"""Part of the similarity that may be lost with the image blobs left out (tails of Gaussians beyond the box)."""

similarity_of = eqx.filter_jit(
    lambda body, pose, views, terms: similarity_among(terms).of_blobs(body.posed_blobs(pose), views)
)


@pytest.fixture(scope="module")
def scene():
    """A dog before four small cameras: tracker, cells and the state whose pose is the true one."""
    body = in_colors(shipped("dog"))
    rig = ring_rig(4, (160, 120), distance=1.5)
    pose = standing(body, 1.1)
    cells = cells_of(rig, draw(body, pose, rig), 6)
    return make_tracker(body, rig), jnp.asarray(cells), TrackState.from_pose(jnp.asarray(pose))


def unculled(tracker, cells):
    """Views of every leaf of the quad-trees."""
    colors, leaves = eqx.filter_jit(lambda reader, rgb: reader.leaves(rgb))(
        tracker.reader, cells.astype(jnp.float32) / 255.0
    )
    candidates = tracker.reader.candidates
    select = jax.jit(jax.vmap(keep_blobs, in_axes=(0, 0, 0, 0, None)), static_argnums=4)
    images, _, _ = select(candidates.means, candidates.sigmas, colors, leaves, candidates.sigmas.shape[1])
    body = tracker.body
    blobs = Sog.from_arrays(
        jnp.zeros((body.num_blobs, 3)), body.blob_sigmas, from_rgb(body.blob_colors, "hsv_cylinder")
    )
    radius = tracker.reader.color_radius
    return Views.from_images(tracker.cameras, images, blobs, tracker.normalizers, "hsv_cylinder", radius)


@pytest.mark.slow
def test_culling_does_not_change_the_energy(scene):
    """At the last pose and at others that a step may lead to."""
    tracker, cells, state = scene
    views, num_near, num_matching = eqx.filter_jit(tracker.views)(FrameInput(cells), state, Capacities(2048, 2048))
    everything = unculled(tracker, cells)
    leaves = int(everything.images.mask.sum())
    assert 0 < int(num_matching.sum()) < int(num_near.sum()) < leaves
    rng = np.random.default_rng(0)
    for spread in (0.0, 0.03, 0.1):
        pose = state.previous + jnp.asarray(rng.normal(size=state.previous.shape) * spread, jnp.float32)
        expected = similarity_of(tracker.body, pose, everything, tracker.terms)
        assert expected > 1e-3
        np.testing.assert_allclose(similarity_of(tracker.body, pose, views, tracker.terms), expected, rtol=CULLED)


@pytest.mark.slow
def test_counts_are_true_ones_whatever_the_capacity(scene):
    tracker, cells, state = scene
    views = eqx.filter_jit(tracker.views)
    _, near, matching = views(FrameInput(cells), state, Capacities(2048, 2048))
    _, near_small, _ = views(FrameInput(cells), state, Capacities(8, 8))
    _, _, matching_small = views(FrameInput(cells), state, Capacities(2048, 8))
    assert near_small.tolist() == near.tolist()
    assert matching_small.tolist() == matching.tolist()
    assert int(near.min()) > 8
    assert int(matching.min()) > 8


@pytest.mark.slow
def test_blobs_of_the_background_are_left_out_and_others_weighted(scene):
    """The background is the picture itself, but for one quarter, and another in which it is unknown."""
    tracker, cells, _ = scene
    rgb = cells.astype(jnp.float32) / 255.0
    rows, columns = rgb.shape[1] // 2, rgb.shape[2] // 2
    background = BackgroundCells(
        cells.at[:, :rows, :columns, 0].set(jnp.where(cells[:, :rows, :columns, 0] > 127, 20, 220)),
        jnp.zeros(rgb.shape[:3]),
        jnp.ones(rgb.shape[:3], bool).at[:, rows:, columns:].set(False),
    )
    reader = eqx.tree_at(
        lambda r: (r.color_tolerance, r.background),
        tracker.reader,
        (jnp.asarray(-1.0), BackgroundModel.from_background(background)),
        is_leaf=lambda leaf: leaf is None,
    )
    _, leaves = eqx.filter_jit(lambda reader, rgb: reader.leaves(rgb))(reader, rgb)
    shape = reader.candidates.shape
    of_cells = np.asarray(leaves)[:, : shape[0] * shape[1]].reshape(-1, *shape)
    assert of_cells[:, :rows, :columns].mean() > 0.9
    assert of_cells[:, rows : rgb.shape[1], columns : rgb.shape[2]].mean() > 0.9
    assert not of_cells[:, rows:, :columns].any()
    assert not of_cells[:, :rows, columns:].any()
    everywhere = jnp.tile(jnp.array([[-1e4, -1e4], [1e4, 1e4]]), (rgb.shape[0], 1, 1, 1))
    near, weights, counts = eqx.filter_jit(
        lambda reader, rgb: reader.near_blobs(rgb, reader.odds(rgb), everywhere, 2048)
    )(reader, rgb)
    assert counts.tolist() == np.asarray(leaves).sum(axis=1).tolist()
    weights = np.asarray(weights.foreground)[np.asarray(near.mask)]
    assert (weights > 0.0).all()
    assert weights.max() == 1.0


@pytest.mark.slow
def test_a_box_holds_the_discs_of_its_actor_and_nothing_more():
    """Three sigmas around every blob, then a border; empty for an actor behind the camera."""
    bodies = [random_body(4, "first"), random_body(5, "second")]
    both = concatenate(bodies)
    actors = both.blob_actors
    roots = [_root(both.skeleton.parents, joint) for joint in both.blobs.joints]
    assert [roots.index(r) for r in roots] == [list(actors).index(a) for a in actors]
    camera = ring_rig(1, distortion=(0.0,) * 5).camera("cam0")
    rng = np.random.default_rng(0)
    means = rng.normal(size=(both.num_blobs, 3)) * 0.3 + [0.0, 0.0, 1.2]
    last = actors == actors.max()
    eye = -np.asarray(camera.camera_from_world)[:3, :3].T @ np.asarray(camera.camera_from_world)[:3, 3]
    means[last] = means[last] - [0.0, 0.0, 1.2] + 3.0 * eye
    blobs = Sog.from_arrays(jnp.asarray(means, jnp.float32), both.blob_sigmas, both.blob_colors)
    boxes = body_boxes(blobs, camera, actors, jnp.asarray(0.1))
    seen = project(camera, blobs)
    for actor in set(actors[~last].tolist()):
        mine = actors == actor
        radius = BLOB_RADIUS * np.asarray(seen.sigmas)[mine, None]
        centre = np.asarray(seen.means)[mine]
        low, high = (centre - radius).min(axis=0), (centre + radius).max(axis=0)
        border = 0.1 * (high - low)
        np.testing.assert_allclose(boxes[actor], [low - border, high + border], rtol=1e-4)
    assert (boxes[-1, 0] == np.inf).all()
    assert (boxes[-1, 1] == -np.inf).all()
    np.testing.assert_array_equal(union_boxes(boxes, boxes[::-1])[0], union_boxes(boxes, boxes[::-1])[-1])
    np.testing.assert_array_equal(union_boxes(boxes[:1], boxes[-1:]), boxes[:1])


def _root(parents, joint):
    return joint if parents[joint] < 0 else _root(parents, parents[joint])


@pytest.mark.parametrize(("count", "headroom"), [(0, 1.0), (256, 1.0), (257, 1.0), (1000, 1.6), (60000, 1.6)])
def test_a_capacity_holds_its_count(count, headroom):
    capacity = capacity_for(count, headroom)
    assert capacity >= count
    assert capacity in CAPACITIES
    smaller = [c for c in CAPACITIES if c < capacity]
    assert all(c < headroom * count for c in smaller)


@given(st.integers(0, 200_000))
def test_room_for_blocks_is_one_of_few(count):
    room = block_capacity(count)
    assert count <= room <= 1.25 * count + BLOCK_STEP
    assert block_capacity(room) == room
    assert room // BLOCK_STEP in {few << k for few in range(1, 9) for k in range(9)}


def test_more_blobs_than_the_largest_capacity_are_an_error():
    with pytest.raises(InputError, match=str(CAPACITIES[-1])):
        capacity_for(CAPACITIES[-1] + 1)
    assert Capacities(256, 512).hold(256, 512)
    assert not Capacities(256, 512).hold(257, 0)
    assert not Capacities(256, 512).hold(0, 513)
