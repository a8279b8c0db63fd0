"""The penalties of Eq. 10, the normaliser of Eq. 9, and several actors under one cap."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_cases import ring_rig
from sog_cases import random_views
from tiny_body import make_body

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.overlap import self_overlaps
from sogjax.energy.posed import History
from sogjax.energy.priors import acceleration_penalty, limit_penalty
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.model.body import concatenate
from sogjax.model.camera import Camera
from sogjax.scene.cells import CellGrid
from sogjax.scene.quadtree import Candidates, keep_blobs, quadtree

FLOAT32 = 1e-5
energy_and_values = eqx.filter_jit(lambda energy, pose: (energy(pose), energy.values(pose)))
numbers = st.floats(-3.0, 3.0, width=32)


@given(value=numbers, excess=st.floats(0.0, 2.0, width=32))
@settings(deadline=None, max_examples=40)
def test_the_limit_penalty_is_0_within_and_the_squared_distance_beyond(value, excess):
    lower, upper = jnp.array([-1.0, -jnp.inf, 0.5]), jnp.array([2.0, jnp.inf, 0.5])
    within = jnp.array([float(np.clip(value, -1.0, 2.0)), value, 0.5])
    assert limit_penalty(within, lower, upper) == 0.0
    above, below = jnp.array([2.0 + excess, value, 0.5]), jnp.array([-1.0 - excess, value, 0.5 - excess])
    np.testing.assert_allclose(limit_penalty(above, lower, upper), excess**2, atol=1e-5)
    np.testing.assert_allclose(limit_penalty(below, lower, upper), 2.0 * excess**2, atol=1e-5)


@pytest.mark.parametrize("distance", [-0.5, 0.0, 0.5])
def test_the_limit_penalty_is_smooth_at_the_limit(distance):
    slope = jax.grad(lambda x: limit_penalty(x[None], jnp.array([-1.0]), jnp.array([2.0])))
    np.testing.assert_allclose(slope(jnp.asarray(2.0 + distance)), 2.0 * max(distance, 0.0), rtol=FLOAT32)
    np.testing.assert_allclose(slope(jnp.asarray(-1.0 - distance)), -2.0 * max(distance, 0.0), rtol=FLOAT32)


def test_constant_motion_has_no_acceleration_and_a_parabola_a_constant_one():
    """0.5 (x(t-2) + x(t)) - x(t-1) is half the second difference, so a for x = a t^2."""
    rng = np.random.default_rng(0)
    start, speed, bend = (jnp.asarray(rng.normal(size=4), jnp.float32) for _ in range(3))
    line = [start + speed * float(t) for t in range(3)]
    np.testing.assert_allclose(acceleration_penalty(line[2], line[1], line[0]), 0.0, atol=1e-12)
    parabola = [start + speed * float(t) + bend * float(t * t) for t in range(7)]
    for t in (2, 6):
        found = acceleration_penalty(parabola[t], parabola[t - 1], parabola[t - 2])
        np.testing.assert_allclose(found, jnp.sum(bend**2), rtol=1e-4)


@jax.jit
def kept(means, sigmas, colors, leaves):
    """Leaves as a Sog, the overlap of each with itself, and how many there are."""
    image, _, count = keep_blobs(means, sigmas, colors, leaves, 1024)
    return image, self_overlaps(image), count


@pytest.mark.parametrize("tolerance", [-1.0, 0.05, 0.2, 10.0])
def test_the_normaliser_is_the_sum_over_a_quadtree_of_the_whole_image(tolerance):
    """(pi/4) x area, however finely the tree is split."""
    width, height = 192, 128
    grid = CellGrid.from_depth(width, height, 5)
    camera = jax.tree.map(lambda leaf: leaf[:1], ring_rig(1, (width, height), distortion=(0.0,) * 5).cameras)
    candidates = Candidates.from_grids([grid], camera)
    one = jax.tree.map(lambda leaf: leaf[0], candidates)
    cells = jnp.asarray(np.random.default_rng(1).random((grid.rows, grid.columns, 3)) ** 3, jnp.float32)
    colors, leaves = jax.jit(quadtree)(cells, one, jnp.asarray(tolerance))
    image, overlaps, count = kept(one.means, one.sigmas, colors, leaves)
    assert count <= 1024
    total = np.sum(np.where(image.mask, overlaps, 0.0))
    np.testing.assert_allclose(total, whole_image_overlap(jnp.array([192.0, 128.0])), rtol=FLOAT32)


def test_weights_enter_as_in_eq_10():
    body = make_body()
    pose = jnp.asarray(np.random.default_rng(2).normal(size=body.skeleton.num_dofs) * 0.2, jnp.float32)
    views = random_views(ring_rig(2).cameras, body, 0, count=20)
    history = History(pose * 0.5, pose * 0.3, jnp.asarray(True))
    with_weights = lambda *weights: FrameEnergy(body, views, history, standard_terms(*weights))
    plain, values = energy_and_values(with_weights(0.0, 0.0), pose)
    heavy, same_values = energy_and_values(with_weights(3.0, 2.0), pose)
    assert plain == values["similarity"] == same_values["similarity"]
    expected = plain - 3.0 * values["limit_penalty"] - 2.0 * values["acceleration_penalty"]
    np.testing.assert_allclose(heavy, expected, rtol=FLOAT32)
    assert values["acceleration_penalty"] > 0.0


def in_rig_centre(body, side):
    """A pose of the tiny body in the middle of the rig, moved to a side (metres)."""
    return jnp.zeros(body.skeleton.num_dofs).at[0].set(side).at[2].set(1.0)


@pytest.mark.slow
@pytest.mark.parametrize(("distance", "competing"), [(0.05, True), (1.2, False)])
def test_two_actors_compete_under_one_cap(distance, competing):
    """What both cover counts once; far from each other their similarities add up."""
    body = make_body()
    both = concatenate([body, body])
    cameras: Camera = ring_rig(2, distortion=(0.0,) * 5).cameras
    left, right = in_rig_centre(body, -distance / 2), in_rig_centre(body, distance / 2)
    pair = jnp.concatenate([left, right])
    views = random_views(cameras, both, 3, count=60, pose=pair, sigmas=(3.0, 4.0))
    alone = lambda part: Views(cameras, views.images, views.color_similarities[:, part], views.normalizers)
    similarity = lambda body, pose, views: float(
        energy_and_values(FrameEnergy(body, views, History.unknown(pose), standard_terms()), pose)[1]["similarity"]
    )
    together = similarity(both, pair, views)
    apart = similarity(body, left, alone(slice(0, 3))) + similarity(body, right, alone(slice(3, 6)))
    assert together > 0.0
    if competing:
        assert together < 0.9 * apart
    else:
        np.testing.assert_allclose(together, apart, rtol=0.02)
