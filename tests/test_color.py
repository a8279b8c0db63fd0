"""Colour spaces against OpenCV's, and the colour similarity of Eq. 7."""

import cv2
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sogjax.model.color import (
    COLOR_RADIUS,
    SHADING,
    SPREAD,
    averaging_space,
    color_distance,
    color_similarity,
    convert,
    distance_from_box,
    from_rgb,
    to_rgb,
    wendland,
)

SPACES = sorted(COLOR_RADIUS)
FLOAT32 = 2e-5
OPENCV_LAB = 4e-3
"""OpenCV interpolates Lab in a table."""

rgb_values = st.tuples(*[st.integers(0, 255)] * 3)
forward = jax.jit(from_rgb, static_argnames="space")
backward = jax.jit(to_rgb, static_argnames="space")


def random_rgb(seed=0, count=500):
    """Random colours, greys, the corners and edges of the cube."""
    rng = np.random.default_rng(seed)
    grey = np.repeat(rng.random((20, 1)), 3, axis=1)
    edges = np.array([[r, g, b] for r in (0, 0.5, 1) for g in (0, 0.5, 1) for b in (0, 0.5, 1)])
    return np.concatenate([rng.random((count, 3)), grey, edges]).astype(np.float32)


def opencv(rgb, code):
    return cv2.cvtColor(rgb.reshape(-1, 1, 3), code).reshape(-1, 3)


def test_hsv_is_opencvs():
    rgb = random_rgb()
    expected = opencv(rgb, cv2.COLOR_RGB2HSV) / [360.0, 1.0, 1.0]
    difference = np.asarray(forward(rgb, "hsv")) - expected
    difference[:, 0] -= np.rint(difference[:, 0])
    np.testing.assert_allclose(difference, 0.0, atol=FLOAT32)


def test_lab_is_opencvs():
    rgb = random_rgb()
    np.testing.assert_allclose(forward(rgb, "lab"), opencv(rgb, cv2.COLOR_RGB2Lab) / 100.0, atol=OPENCV_LAB)


def test_lab_of_the_primaries_is_the_published_one():
    rgb = jnp.concatenate([jnp.eye(3), jnp.ones((1, 3))])
    published = [[53.24, 80.09, 67.20], [87.73, -86.18, 83.18], [32.30, 79.19, -107.86], [100.0, 0.0, 0.0]]
    np.testing.assert_allclose(forward(rgb, "lab"), np.array(published) / 100.0, atol=2e-4)


def test_cylinder_and_cone_are_hsv_in_other_coordinates():
    rgb = random_rgb()
    hue, saturation, value = (opencv(rgb, cv2.COLOR_RGB2HSV) / [360.0, 1.0, 1.0]).T
    direction = np.stack([np.cos(2 * np.pi * hue), np.sin(2 * np.pi * hue)], axis=1)
    cylinder = np.column_stack([saturation[:, None] * direction, value])
    cone = np.column_stack([(saturation * value)[:, None] * direction, value])
    np.testing.assert_allclose(forward(rgb, "hsv_cylinder"), cylinder, atol=FLOAT32)
    np.testing.assert_allclose(forward(rgb, "hsv_cone"), cone, atol=FLOAT32)


@pytest.mark.parametrize("space", ["rgb", "hsv", "hsv_cylinder", "hsv_shaded"])
def test_no_colour_in_a_box_is_nearer_than_the_box(space):
    """And where a box holds one colour only, it is as near as that, but for hues, which are on a circle."""
    rng = np.random.default_rng(0)
    color, *corners = rng.random((3, 500, 3)).astype(np.float32)
    low, high = np.minimum(*corners), np.maximum(*corners)
    inside = low + rng.random((500, 3)).astype(np.float32) * (high - low)
    planes = lambda colors: [jnp.asarray(colors[:, k]) for k in range(3)]
    least = distance_from_box(planes(color), planes(low), planes(high), space)
    assert np.all(least <= color_distance(jnp.asarray(color), jnp.asarray(inside), space) + 1e-6)
    if space != "hsv":
        single = distance_from_box(planes(color), planes(inside), planes(inside), space)
        np.testing.assert_allclose(single, np.linalg.norm(color - inside, axis=1), rtol=1e-5)


def test_shading_moves_a_colour_by_what_is_usual_for_its_brightness():
    """A part of the brightness more or less: a distance of `SPREAD / SHADING` times that part, at most; hue stays."""
    rgb, part = random_rgb(), 0.02
    shaded = np.asarray(forward(rgb * (1.0 - part), "hsv_shaded"), np.float64)
    lit = np.asarray(forward(rgb, "hsv_shaded"), np.float64)
    value = rgb.max(axis=1).astype(np.float64)
    expected = part * value * SPREAD / np.sqrt(SPREAD**2 + (SHADING * value) ** 2)
    np.testing.assert_allclose(lit[:, 2] - shaded[:, 2], expected, rtol=0.02, atol=FLOAT32)
    np.testing.assert_allclose(lit[:, :2], forward(rgb, "hsv_cylinder")[:, :2], atol=FLOAT32)
    np.testing.assert_allclose(lit[:, :2], shaded[:, :2], atol=1e-4)


@pytest.mark.parametrize("space", SPACES)
@settings(deadline=None)
@given(rgb=rgb_values)
def test_every_colour_comes_back(space, rgb):
    colors = np.array([rgb], np.float32) / 255.0
    np.testing.assert_allclose(backward(forward(colors, space), space), colors, atol=2e-4)


@pytest.mark.parametrize("space", SPACES)
def test_single_colours_and_grids_are_converted_alike(space):
    rgb = random_rgb(count=9)[:12]
    grid = forward(rgb.reshape(3, 4, 3), space)
    np.testing.assert_allclose(grid.reshape(12, 3), forward(rgb, space), atol=1e-6)
    np.testing.assert_allclose(forward(rgb[5], space), grid[1, 1], atol=1e-6)


def test_conversion_goes_by_way_of_rgb_and_leaves_its_own_space_alone():
    lab = forward(random_rgb(), "lab")
    np.testing.assert_allclose(convert(lab, "lab", "rgb"), random_rgb(), atol=2e-4)
    assert convert(lab, "lab", "lab") is lab
    cylinder = forward(random_rgb(), "hsv_cylinder")
    np.testing.assert_allclose(
        convert(cylinder, "hsv_cylinder", "hsv_shaded"), forward(random_rgb(), "hsv_shaded"), atol=FLOAT32
    )


def test_an_unknown_space_is_refused():
    with pytest.raises(ValueError, match="choose one of"):
        from_rgb(jnp.zeros((1, 3)), "xyz")


@settings(deadline=None)
@given(hue=st.floats(0.0, 1.0, width=32), step=st.floats(-0.5, 0.5, width=32))
def test_hue_wraps_around(hue, step):
    """The distance of two hues is the shorter way round the circle, whichever turn they are written in."""
    a = jnp.array([hue, 0.7, 0.4], jnp.float32)
    b = jnp.array([np.mod(hue + step, 1.0), 0.7, 0.4], jnp.float32)
    np.testing.assert_allclose(color_distance(a, b, "hsv"), abs(step), atol=1e-6)
    np.testing.assert_allclose(color_distance(b, a, "hsv"), abs(step), atol=1e-6)


def test_averaging_across_the_wrap_of_hue_gives_red():
    """Two reds, 6 degrees above and below hue 0, average to red and not to cyan."""
    reds = jnp.array([[1.0, 0.0, 0.1], [1.0, 0.1, 0.0]])
    space = averaging_space("hsv")
    mean = backward(jnp.mean(forward(reds, space), axis=0), space)
    less_saturated = 1.0 - np.cos(np.radians(6.0))
    np.testing.assert_allclose(mean, [1.0, less_saturated, less_saturated], atol=1e-5)
    assert all(averaging_space(name) == name for name in SPACES if name not in ("hsv", "hsv_shaded"))


def test_wendland_is_the_c2_function_with_its_values_and_derivatives():
    """1 at 0 with slope 0; value, slope and curvature 0 at 1 and beyond; falling between; (1-r)^4 (4r+1) at r=1/2."""
    derivative, curvature = jax.jit(jax.grad(wendland)), jax.jit(jax.grad(jax.grad(wendland)))
    assert wendland(jnp.array(0.0)) == 1.0
    assert derivative(jnp.array(0.0)) == 0.0
    np.testing.assert_allclose(wendland(jnp.array(0.5)), 3.0 / 16.0, rtol=1e-6)
    for r in (1.0, 1.5, 40.0):
        assert wendland(jnp.array(r)) == derivative(jnp.array(r)) == curvature(jnp.array(r)) == 0.0
    np.testing.assert_allclose(curvature(jnp.array(0.999)), 0.0, atol=1e-3)
    assert (np.diff(wendland(jnp.linspace(0.0, 1.0, 200))) < 0.0).all()


@pytest.mark.parametrize("space", SPACES)
def test_similarity_is_1_for_equal_colours_and_0_from_the_radius_on(space):
    colors = np.asarray(forward(random_rgb(), space))
    radius = COLOR_RADIUS[space]
    compare = jax.jit(lambda others: color_similarity(jnp.asarray(colors), others, space, jnp.asarray(radius)))
    moved = lambda distance: colors + np.array([[0.0, 0.0, distance]], np.float32)
    assert (compare(colors) == 1.0).all()
    assert (compare(moved(radius * 1.001)) == 0.0).all()
    at_half = compare(moved(radius / 2.0))
    np.testing.assert_allclose(at_half, 3.0 / 16.0, rtol=1e-3)


@pytest.mark.parametrize("space", SPACES)
def test_the_gradient_is_finite_and_zero_at_equal_colours(space):
    color = forward(jnp.array([0.3, 0.5, 0.2]), space)
    gradient = jax.jit(jax.grad(lambda c: color_similarity(c, color, space, jnp.asarray(0.2))))
    assert (gradient(color) == 0.0).all()
    assert jnp.isfinite(gradient(color + 0.01)).all()
    assert (gradient(color + 0.01) != 0.0).all()


@pytest.mark.parametrize("space", SPACES)
def test_conversions_have_finite_gradients_at_black_white_and_grey(space):
    jacobian = jax.jit(jax.jacobian(lambda rgb: from_rgb(rgb, space)))
    for level in (0.0, 0.5, 1.0):
        assert jnp.isfinite(jacobian(jnp.full(3, level))).all()
