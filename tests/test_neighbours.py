"""Lists of near pairs: the same energy and gradient as from all pairs, and nothing cut off unseen."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, random_body, shipped
from drawn_scene import standing
from hypothesis import given, settings
from hypothesis import strategies as st
from rig_cases import ring_rig
from slow_values import fast_and_slow
from sog_cases import floats, random_views

from sogjax.energy.frame_energy import FrameEnergy, standard_terms, still_energy
from sogjax.energy.neighbours import MARGIN, displacement
from sogjax.energy.pairs import TILE
from sogjax.energy.posed import History
from sogjax.energy.similarity import similarity_among
from sogjax.model.camera import project
from sogjax.solve.ascent import ConditionedAscent
from sogjax.tracking.solving import pose_scales, solve_near

AGREEMENT = 1e-4
HUMAN = shipped("human")
REST = jnp.asarray(standing(HUMAN, 0.0))
RIG = ring_rig(3)
CAPACITY = 8192

value_and_gradient = eqx.filter_jit(
    lambda body, pose, views, terms: jax.value_and_grad(lambda p: still_energy(body, p, views, terms))(pose)
)
near = eqx.filter_jit(
    lambda views, body, pose, terms, capacity: views.near(
        body.posed_blobs(pose), similarity_among(terms).exponent, capacity
    )
)
projected = jax.jit(jax.vmap(project, (0, None)))
displaced = jax.jit(displacement)
moved = eqx.filter_jit(lambda cameras, body, a, b: displacement(cameras, body.posed_blobs(a), body.posed_blobs(b)))


def scene(seed):
    """Views of the human about its rest pose, in colours of which many are alike; blobs do not fill whole tiles.

    Image blobs that follow each other lie near each other, as those of a quad-tree do.
    """
    views = random_views(RIG.cameras, HUMAN, seed, count=300, padding=5, color_radius=0.5, sigmas=(1.0, 5.0))
    means = views.images.means
    order = jnp.lexsort((means[..., 0], jnp.floor(means[..., 1] / 30.0)), axis=-1)
    images = jax.tree.map(lambda leaf: jax.vmap(lambda part, places: part[places])(leaf, order), views.images)
    similarities = jnp.take_along_axis(views.color_similarities, order[:, None, :], axis=2)
    return eqx.tree_at(lambda v: (v.images, v.color_similarities), views, (images, similarities))


def towards(pose, change, size):
    """The pose moved by a part of a change such that blobs move by `size` margins."""
    far = float(moved(RIG.cameras, HUMAN, pose, pose + 1e-3 * change))
    return pose + 1e-3 * change * (size / far)


@pytest.mark.parametrize("mode", fast_and_slow("forward", "autodiff"))
@pytest.mark.parametrize("capped", fast_and_slow(True, False))
@given(seed=st.integers(0, 1000), size=st.sampled_from([0.0, 0.5, 0.95]))
@settings(deadline=None, max_examples=5)
def test_value_and_gradient_are_those_of_all_pairs_as_far_as_the_margin(mode, capped, seed, size):
    rng = np.random.default_rng(seed)
    views = scene(seed % 5)
    terms = standard_terms(capped=capped, gradient=mode)
    made_at = REST + jnp.asarray(rng.normal(size=REST.shape) * 0.05, jnp.float32)
    pose = towards(made_at, jnp.asarray(rng.normal(size=REST.shape), jnp.float32), size)
    assert float(moved(RIG.cameras, HUMAN, made_at, pose)) <= 1.0
    sparse, count = near(views, HUMAN, made_at, terms, CAPACITY)
    assert count <= CAPACITY
    value, gradient = value_and_gradient(HUMAN, pose, sparse, terms)
    expected_value, expected = value_and_gradient(HUMAN, pose, views, terms)
    np.testing.assert_allclose(value, expected_value, rtol=AGREEMENT)
    assert np.linalg.norm(gradient - expected) <= AGREEMENT * np.linalg.norm(expected)


def test_lists_leave_out_far_pairs_and_no_near_one():
    """Every pair that overlaps is in a block exactly once; written with loops."""
    views = scene(0)
    terms = standard_terms()
    seen = projected(views.cameras, posed(HUMAN, REST)[0])
    sparse, count = near(views, HUMAN, REST, terms, CAPACITY)
    pairs = sparse.pairs
    cameras, bodies, images = views.color_similarities.shape
    wide = pairs.image_shape[1]
    assert wide % TILE == 0
    listed = np.zeros((cameras * bodies, cameras * wide), int)
    real = np.asarray(pairs.amplitudes) > 0.0
    of_body = np.broadcast_to(np.asarray(pairs.body_index)[:, None, :], real.shape)
    of_image = np.asarray(pairs.tile_index)[None, None, :] * TILE + np.arange(TILE)[None, :, None]
    np.add.at(listed, (of_body[real], np.broadcast_to(of_image, real.shape)[real]), 1)
    assert listed.max() == 1
    for camera in range(cameras):
        away = np.asarray(views.images.means[camera])[None] - np.asarray(seen.means[camera])[:, None]
        sizes = np.asarray(views.images.sigmas[camera])[None] ** 2 + np.asarray(seen.sigmas[camera])[:, None] ** 2
        falloff = np.exp(-np.sum(away**2, axis=-1) / (2.0 * sizes))
        matter = (falloff > 1e-4) & (np.asarray(views.color_similarities[camera]) > 0.0)
        block = listed[camera * bodies : (camera + 1) * bodies, camera * wide : camera * wide + images]
        assert (block[matter] == 1).all()
    assert listed.sum() < 0.9 * (np.asarray(views.color_similarities) > 0.0).sum()
    assert count < CAPACITY


def test_the_number_of_blocks_is_the_true_one_whatever_the_capacity():
    views, terms = scene(1), standard_terms()
    _, count = near(views, HUMAN, REST, terms, CAPACITY)
    _, same = near(views, HUMAN, REST, terms, 16)
    assert count == same > 16


def test_displacement_is_the_largest_motion_of_a_blob_in_its_picture():
    before, after = posed(HUMAN, REST)[0], posed(HUMAN, REST.at[0].add(0.03))[0]
    both = [projected(RIG.cameras, blobs).means for blobs in (before, after)]
    widths = np.asarray(RIG.cameras.image_size)[:, 0]
    expected = np.max(np.linalg.norm(both[1] - both[0], axis=-1) / (MARGIN * widths)[:, None])
    np.testing.assert_allclose(displaced(RIG.cameras, before, after), expected, rtol=1e-5)


def test_a_blob_that_comes_into_view_has_moved_too_far():
    camera = jax.tree.map(lambda leaf: leaf[:1], RIG.cameras)
    blobs = posed(HUMAN, REST)[0]
    eye = -np.asarray(camera.camera_from_world[0, :3, :3]).T @ np.asarray(camera.camera_from_world[0, :3, 3])
    behind = eqx.tree_at(lambda b: b.means, blobs, blobs.means.at[0].set(floats(1.5 * eye)))
    assert np.isinf(displaced(camera, blobs, behind))


@pytest.mark.slow
def test_lists_are_made_anew_until_the_pose_lies_where_they_hold():
    """From a start many margins away the value at the end is that of all pairs, and as high as with them."""
    body = random_body(4, joints=5, dofs=4, blobs=6)
    body = eqx.tree_at(lambda b: b.blobs.offsets, body, body.blobs.offsets + jnp.array([[0.0, 0.0, 1.0]]))
    rig = ring_rig(2)
    views = random_views(rig.cameras, body, 0, count=40)
    history = History.unknown(body.poses["rest"])
    objective = FrameEnergy(body, views, history, standard_terms())
    start = body.poses["rest"] + 0.25
    solver, scales = ConditionedAscent(epsilon=1e-3), pose_scales(body.skeleton)
    solve = eqx.filter_jit(solve_near)
    sparse, count = solve(solver, objective, start, scales, 64)
    dense = eqx.filter_jit(solver.maximize)(objective, start, scales)
    assert float(moved(rig.cameras, body, start, sparse.params)) > 1.0
    assert sparse.converged
    assert 0 < count <= 64
    np.testing.assert_allclose(sparse.value, objective(sparse.params), rtol=AGREEMENT)
    assert sparse.value > 0.99 * dense.value
    bounded, _ = solve(solver, objective, start, scales, 64, jnp.asarray(4))
    assert float(moved(rig.cameras, body, start, bounded.params)) > 1.0
    assert 0 < bounded.iterations <= 4
    np.testing.assert_allclose(bounded.value, objective(bounded.params), rtol=AGREEMENT)
