"""Derivatives of the energy other than its gradient by the pose: forward mode, second ones, and by colours."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body
from rig_cases import ring_rig
from slow_values import fast_and_slow
from sog_cases import floats, in_float64, random_views

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.posed import History

STEP = 1e-5
DIFFERENCES = 1e-6
near = eqx.filter_jit(FrameEnergy.near)
value = eqx.filter_jit(lambda energy, pose: energy(pose))
gradient = eqx.filter_jit(lambda energy, pose: jax.grad(energy)(pose))


def scene(sparse=False, capped=True, gradient="forward"):
    """In double precision, lists of near pairs made at the pose."""
    body = random_body(4, joints=5, dofs=4, blobs=6)
    body = in_float64(eqx.tree_at(lambda b: b.blobs.offsets, body, body.blobs.offsets + jnp.array([[0.0, 0.0, 1.0]])))
    views = random_views(ring_rig(2).cameras, body, 0, count=40, padding=3)
    pose = floats(body.poses["rest"]) + 0.1
    history = History(pose - 0.1, pose - 0.15, jnp.asarray(True))
    energy = FrameEnergy(body, views, history, standard_terms(0.7, 0.3, capped=capped, gradient=gradient))
    return (near(energy, pose, 64)[0] if sparse else energy), pose


@pytest.mark.parametrize("sparse", fast_and_slow(True, False))
@pytest.mark.parametrize("mode", fast_and_slow("forward", "autodiff"))
def test_forward_mode_is_reverse_mode(mode, sparse):
    with jax.enable_x64(True):
        energy, pose = scene(sparse, gradient=mode)
        forward = eqx.filter_jit(lambda energy, pose: jax.jacfwd(energy)(pose))(energy, pose)
        np.testing.assert_allclose(forward, gradient(energy, pose), rtol=1e-10, atol=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize("sparse", fast_and_slow(True, False))
@pytest.mark.parametrize("capped", fast_and_slow(True, False))
def test_second_derivatives_are_differences_of_the_gradient(capped, sparse):
    """Forward over reverse, and forward over forward."""
    with jax.enable_x64(True):
        energy, pose = scene(sparse, capped)
        expected = np.stack(
            [(gradient(energy, pose + STEP * e) - gradient(energy, pose - STEP * e)) / (2 * STEP) for e in jnp.eye(4)]
        )
        for second in (lambda f: jax.jacfwd(jax.grad(f)), lambda f: jax.jacfwd(jax.jacfwd(f))):
            found = eqx.filter_jit(lambda energy, pose, of=second: of(energy)(pose))(energy, pose)
            np.testing.assert_allclose(found, expected, atol=DIFFERENCES * np.abs(expected).max())


def views_anew(energy, pose, body_colors, image_colors, radius, sparse):
    """The energy whose similarities are made of these colours."""
    body = eqx.tree_at(lambda b: b.blob_colors, energy.body, body_colors)
    images = eqx.tree_at(lambda i: i.colors, energy.views.images, image_colors)
    views = energy.views
    blobs = body.posed_blobs(pose)
    remade = type(views).from_images(views.cameras, images, blobs, views.normalizers, "rgb", radius)
    anew = FrameEnergy(body, remade, energy.history, energy.terms)
    return anew.near(pose, 64)[0] if sparse else anew


@eqx.filter_jit
def value_anew(energy, pose, body_colors, image_colors, radius, sparse):
    return views_anew(energy, pose, body_colors, image_colors, radius, sparse)(pose)


@pytest.mark.parametrize("sparse", fast_and_slow(True, False))
@pytest.mark.parametrize("what", fast_and_slow("body", "images", "radius"))
def test_the_derivative_by_colours_is_that_of_similarities_made_anew(what, sparse):
    """Along a random direction, against central differences in which Eq. 7 is computed again."""
    with jax.enable_x64(True):
        energy, pose = scene(sparse)
        rng = np.random.default_rng(5)
        leaves = (energy.body.blob_colors, energy.views.images.colors, energy.views.coloring.radius)
        place = ("body", "images", "radius").index(what)
        direction = floats(rng.normal(size=leaves[place].shape) * 0.1)
        if what == "images":
            direction = jnp.where(energy.views.images.mask[..., None], direction, 0.0)
        of = lambda e: (e.body.blob_colors, e.views.images.colors, e.views.coloring.radius)[place]

        def moved(size):
            changed = tuple(leaf + size * direction if k == place else leaf for k, leaf in enumerate(leaves))
            return float(value_anew(energy, pose, *changed, sparse))

        expected = (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
        by_leaf = lambda leaf: eqx.tree_at(of, energy, leaf)(pose)
        forward = jax.jit(lambda leaf: jax.jvp(by_leaf, (leaf,), (direction,))[1])(leaves[place])
        reverse = jax.jit(jax.grad(by_leaf))(leaves[place])
        assert abs(expected) > 1e-5
        np.testing.assert_allclose(forward, expected, rtol=1e-5)
        np.testing.assert_allclose(jnp.sum(reverse * direction), expected, rtol=1e-5)


@pytest.mark.slow
def test_where_similarities_are_no_function_of_colours_differentiating_by_them_is_an_error():
    energy, pose = scene()
    other = eqx.tree_at(lambda e: e.views.coloring, energy, None)
    np.testing.assert_allclose(value(other, pose), value(energy, pose), rtol=1e-6)
    assert jnp.isfinite(gradient(other, pose)).all()
    with pytest.raises(TypeError, match="differentiated by colours"):
        jax.grad(lambda colors: eqx.tree_at(lambda e: e.body.blob_colors, other, colors)(pose))(other.body.blob_colors)


@pytest.mark.slow
@pytest.mark.parametrize("sparse", fast_and_slow(True, False))
def test_the_value_of_the_quadratic_model_has_the_same_derivative_by_colours(sparse):
    with jax.enable_x64(True):
        energy, pose = scene(sparse)
        recolored = lambda colors: eqx.tree_at(lambda e: e.body.blob_colors, energy, colors)
        of_value = jax.grad(lambda colors: recolored(colors)(pose))(energy.body.blob_colors)
        of_model = jax.grad(lambda colors: recolored(colors).quadratic(pose).value)(energy.body.blob_colors)
        assert np.abs(of_value).max() > 0.0
        np.testing.assert_allclose(of_model, of_value, rtol=1e-9, atol=1e-14)
