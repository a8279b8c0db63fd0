"""Overlap of Sums of Gaussians (Eq. 5, 6, 8) against quadrature, finite differences and plain autodiff."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from slow_values import fast_and_slow
from sog_cases import floats, in_float64, random_sog, similarities

from sogjax.energy.overlap import (
    EXACT_EXPONENT,
    PRINTED_EXPONENT,
    capped_overlap,
    overlaps,
    pair_color_similarities,
    self_overlaps,
)
from sogjax.model.sog import Sog

FLOAT32 = 2e-5
FLOAT32_GRADIENT = 2e-4
FLOAT64 = 1e-10
MODES = ["forward", "autodiff"]
seeds = st.integers(0, 10_000)


def quadrature(mean_a, sigma_a, mean_b, sigma_b):
    """The integral over the plane of the product of two Gaussians (Eq. 2), by the trapezium rule."""
    reach, step = 8.0 * min(sigma_a, sigma_b), 0.1 * min(sigma_a, sigma_b)
    middle = mean_a if sigma_a < sigma_b else mean_b
    axis = np.arange(-reach, reach, step)
    points = np.stack(np.meshgrid(axis, axis), axis=-1) + middle
    gaussian = lambda mean, sigma: np.exp(-np.sum((points - mean) ** 2, axis=-1) / (2.0 * sigma**2))
    return np.sum(gaussian(mean_a, sigma_a) * gaussian(mean_b, sigma_b)) * step**2


def total(image, body, colors, exponent=EXACT_EXPONENT, capped=True, gradient="forward"):
    return capped_overlap(image, body, colors, jnp.asarray(exponent), capped=capped, gradient=gradient)


jit_total = jax.jit(total, static_argnames=("capped", "gradient"))
gradients = eqx.filter_jit(
    eqx.filter_value_and_grad(lambda args, capped, mode: capped_overlap(*args, capped=capped, gradient=mode))
)
"""Value and the gradient by (image, body, colour similarities, exponent)."""


def blob(mean, sigma):
    return Sog.from_arrays(floats([mean]), floats([sigma]), jnp.zeros((1, 3)))


def blobs(means, sigmas):
    return Sog.from_arrays(floats(means), floats(sigmas), jnp.zeros((len(sigmas), 3)))


def quadrature_matrix(image, body):
    pairs = [
        [quadrature(mi, si, mj, sj) for mi, si in zip(*two_d(image), strict=True)]
        for mj, sj in zip(*two_d(body), strict=True)
    ]
    return np.array(pairs)


def two_d(sog):
    return np.asarray(sog.means, float), np.asarray(sog.sigmas, float)


def test_the_exact_exponent_is_the_integral_and_the_printed_one_is_not():
    image, body = random_sog(0, 7), random_sog(1, 5)
    ones = jnp.ones((5, 7))
    expected = quadrature_matrix(image, body)
    np.testing.assert_allclose(overlaps(image, body, ones, jnp.asarray(EXACT_EXPONENT)), expected, rtol=1e-3, atol=1e-6)
    printed = np.asarray(overlaps(image, body, ones, jnp.asarray(PRINTED_EXPONENT)))
    apart = expected > 1e-3
    assert (printed < 0.99 * expected)[apart].all()


def test_an_overlap_is_proportional_to_the_colour_similarity():
    image, body = random_sog(0, 7), random_sog(1, 5)
    colors = similarities(image, body)
    ones = jnp.ones_like(colors)
    exponent = jnp.asarray(EXACT_EXPONENT)
    np.testing.assert_allclose(
        overlaps(image, body, colors, exponent), colors * overlaps(image, body, ones, exponent), rtol=FLOAT32
    )


def test_self_overlap_is_the_integral_of_the_square():
    image = random_sog(3, 6)
    expected = [quadrature(mean, sigma, mean, sigma) for mean, sigma in zip(*two_d(image), strict=True)]
    np.testing.assert_allclose(self_overlaps(image), expected, rtol=1e-5)
    pairs = overlaps(image, image, jnp.ones((6, 6)), jnp.asarray(EXACT_EXPONENT))
    np.testing.assert_allclose(jnp.diag(pairs), expected, rtol=1e-5)


@pytest.mark.parametrize("mode", MODES)
def test_blobs_that_hide_each_other_count_once_and_uncapped_twice(mode):
    image = blob([10.0, 10.0], 4.0)
    one = blobs([[10.0, 10.0]], [4.0])
    two = blobs([[10.0, 10.0], [10.0, 10.0]], [4.0, 4.0])
    area = np.pi * 16.0
    at = lambda body, capped: jit_total(image, body, jnp.ones((body.capacity, 1)), capped=capped, gradient=mode)
    np.testing.assert_allclose([at(one, True), at(two, True)], area, rtol=FLOAT32)
    np.testing.assert_allclose([at(one, False), at(two, False)], [area, 2.0 * area], rtol=FLOAT32)


@given(seed=seeds)
@settings(deadline=None, max_examples=20)
def test_the_capped_sum_is_eq_8_written_with_loops(seed):
    image, body = random_sog(seed, 7), random_sog(seed + 1, 5, sigmas=(5.0, 20.0))
    colors = similarities(image, body)
    expected = 0.0
    for i, (mi, si) in enumerate(zip(*two_d(image), strict=True)):
        pairs = 0.0
        for j, (mj, sj) in enumerate(zip(*two_d(body), strict=True)):
            variance = si**2 + sj**2
            pairs += (
                float(colors[j, i])
                * 2.0 * np.pi * (si * sj) ** 2 / variance
                * np.exp(-np.sum((mi - mj) ** 2) / (2.0 * variance))
            )  # fmt: skip
        expected += min(pairs, np.pi * si**2)
    np.testing.assert_allclose(jit_total(image, body, colors), expected, rtol=FLOAT32)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize(("sigma", "live"), [(4.0, False), (6.0, False), (3.9, True)])
def test_the_gradient_is_zero_where_the_sum_reaches_the_cap(mode, sigma, live):
    """Also at the exact tie: an equal blob in the same place reaches the cap to the last bit."""
    image, body = blob([8.0, 8.0], 4.0), blob([8.0, 8.0], sigma)
    (value, (_, by_body, by_color, _)) = gradients(
        (image, body, jnp.ones((1, 1)), jnp.asarray(EXACT_EXPONENT)), True, mode
    )
    assert (value < np.pi * 16.0) == live
    assert (by_body.sigmas != 0.0).all() == live
    assert (by_color != 0.0).all() == live
    assert (by_body.means == 0.0).all()


@pytest.mark.parametrize("mode", fast_and_slow(*MODES))
def test_padding_is_inert_in_value_and_gradient(mode):
    """Whatever stands in the padding, sigmas of 0 included, which divide 0 by 0 where nobody masks them."""
    image, body = random_sog(5, 7), random_sog(6, 5)
    colors = similarities(image, body)
    padded_image, padded_body = random_sog(5, 7, padding=2), random_sog(6, 5, padding=3)
    zero_sigma = lambda sog: eqx.tree_at(lambda s: s.sigmas, sog, jnp.where(sog.mask, sog.sigmas, 0.0))
    exponent = jnp.asarray(EXACT_EXPONENT)
    value, (_, by_body, _, _) = gradients((image, body, colors, exponent), True, mode)
    for change in (lambda sog: sog, zero_sigma):
        wide_image, wide_body = change(padded_image), change(padded_body)
        wide_colors = similarities(wide_image, wide_body)
        args = (wide_image, wide_body, wide_colors, exponent)
        wide_value, (by_wide_image, by_wide, by_color, by_exponent) = gradients(args, True, mode)
        np.testing.assert_allclose(wide_value, value, rtol=FLOAT32)
        np.testing.assert_allclose(by_wide.means[:5], by_body.means, rtol=FLOAT32_GRADIENT, atol=1e-4)
        np.testing.assert_allclose(by_wide.sigmas[:5], by_body.sigmas, rtol=FLOAT32_GRADIENT, atol=1e-4)
        assert (by_wide.means[5:] == 0.0).all()
        assert (by_wide.sigmas[5:] == 0.0).all()
        for leaf in jax.tree.leaves((by_wide_image.means, by_wide_image.sigmas, by_color, by_exponent)):
            assert jnp.isfinite(leaf).all()


def test_padding_resembles_no_colour():
    image, body = random_sog(5, 7, padding=2), random_sog(6, 5, padding=3)
    colors = pair_color_similarities(image, body, "rgb", jnp.asarray(10.0))
    assert (colors[:5, :7] > 0.0).all()
    assert (colors[5:] == 0.0).all()
    assert (colors[:, 7:] == 0.0).all()


@pytest.mark.parametrize("capped", [True, False])
@given(seed=seeds)
@settings(deadline=None, max_examples=15)
def test_the_forward_gradient_is_that_of_autodiff(capped, seed):
    """By the body, and by whatever else one may ask for: image, colours, exponent."""
    image, body = random_sog(seed, 7), random_sog(seed + 1, 5, sigmas=(5.0, 20.0))
    args = (image, body, similarities(image, body), jnp.asarray(0.7))
    _assert_same_gradients(args, capped, FLOAT32_GRADIENT)


@pytest.mark.parametrize("capped", [True, False])
@pytest.mark.parametrize("coinciding", fast_and_slow(False, True))
def test_the_forward_gradient_is_that_of_autodiff_in_float64(capped, coinciding):
    with jax.enable_x64(True):
        image, body = random_sog(11, 7), random_sog(12, 5, sigmas=(5.0, 20.0))
        if coinciding:
            body = eqx.tree_at(lambda b: b.means, body, body.means.at[1].set(body.means[0]).at[2].set(image.means[0]))
        args = in_float64((image, body, similarities(image, body), floats(0.5)))
        assert args[0].means.dtype == jnp.float64
        _assert_same_gradients(args, capped, FLOAT64)


def _assert_same_gradients(args, capped, tolerance):
    value, forward = gradients(args, capped, "forward")
    plain_value, plain = gradients(args, capped, "autodiff")
    np.testing.assert_allclose(value, plain_value, rtol=tolerance)
    leaves, plain_leaves = jax.tree.leaves(forward), jax.tree.leaves(plain)
    assert len(leaves) == len(plain_leaves)
    for leaf, expected in zip(leaves, plain_leaves, strict=True):
        np.testing.assert_allclose(leaf, expected, rtol=tolerance, atol=tolerance * float(jnp.max(jnp.abs(expected))))


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("capped", [True, False])
def test_the_gradient_is_that_of_finite_differences(mode, capped):
    """Central differences in double precision, by every number of the body."""
    step = 1e-5
    with jax.enable_x64(True):
        image, body = random_sog(21, 7), random_sog(22, 5, sigmas=(3.0, 9.0))
        colors, exponent = similarities(image, body), floats(0.5)
        _, (_, by_body, _, _) = gradients((image, body, colors, exponent), capped, mode)
        numbers = np.concatenate([np.asarray(body.means).ravel(), np.asarray(body.sigmas)])
        assert numbers.dtype == np.float64

        def value_at(numbers):
            moved = Sog(floats(numbers[:10].reshape(5, 2)), floats(numbers[10:]), body.colors, body.mask)
            return float(jit_total(image, moved, colors, 0.5, capped=capped, gradient=mode))

        differences = [
            (value_at(numbers + step * unit) - value_at(numbers - step * unit)) / (2.0 * step) for unit in np.eye(15)
        ]
        found = np.concatenate([by_body.means.ravel(), by_body.sigmas])
        np.testing.assert_allclose(found, differences, rtol=1e-6, atol=1e-7)


@pytest.mark.parametrize("mode", MODES)
def test_batches_of_images_give_what_single_ones_do(mode):
    images = [random_sog(k, 7) for k in range(3)]
    body = random_sog(9, 5)
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *images)

    def value(means, image):
        moved = Sog(means, body.sigmas, body.colors, body.mask)
        return capped_overlap(image, moved, similarities(image, body), jnp.asarray(0.5), gradient=mode)

    one = jax.jit(jax.value_and_grad(value))
    values, found = jax.jit(jax.vmap(jax.value_and_grad(value), in_axes=(None, 0)))(body.means, stacked)
    singles = [one(body.means, image) for image in images]
    np.testing.assert_allclose(values, [v for v, _ in singles], rtol=FLOAT32)
    np.testing.assert_allclose(found, np.stack([g for _, g in singles]), rtol=FLOAT32_GRADIENT, atol=1e-4)
