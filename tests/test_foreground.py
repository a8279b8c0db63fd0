"""Foreground against background: what cells say, windows around a body, and the term of the energy."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body
from rig_cases import opencv_pixels, ring_rig
from sog_cases import floats, in_float64, random_views

from sogjax.energy.foreground import Foreground
from sogjax.energy.posed import Frame, History, Posed
from sogjax.energy.views import COLUMNS, ROWS, Windows, windows_around
from sogjax.scene.background import BackgroundCells
from sogjax.scene.color_clusters import cluster_odds, odds_where_told
from sogjax.scene.foreground import (
    DEEP_SHADOW,
    LARGEST,
    SHADOW,
    SHADOWED,
    BackgroundModel,
    background_surprise,
    foreground_weights,
    log_odds,
    subject_colors,
)

WALL, SHIRT, SKIN = (0.5, 0.6, 0.7), (0.1, 0.2, 0.6), (0.6, 0.42, 0.33)
odds_of = jax.jit(
    lambda cells, background, subject: log_odds(cells, BackgroundModel.from_background(background), subject)
)


def wall(rows=12, columns=15, color=WALL):
    shape = (1, rows, columns)
    return BackgroundCells(
        np.tile(np.rint(255.0 * np.array(color)).astype(np.uint8), (*shape, 1)),
        jnp.full(shape, 0.01),
        jnp.ones(shape, bool),
    )


def seen(background, color, gain=1.0):
    """A frame of the background with a square of another colour."""
    cells = np.array(background.colors) / 255.0
    cells[:, 3:7, 3:7] = color
    return jnp.asarray(gain * cells, jnp.float32)


def subject(*colors):
    return jnp.asarray(subject_colors(np.array(colors), np.ones(len(colors))), jnp.float32)


def test_a_cell_of_another_colour_is_foreground_and_one_of_the_backgrounds_is_not():
    odds = odds_of(seen(wall(), SHIRT), wall(), subject(SHIRT, SKIN))
    assert (odds[0, 3:7, 3:7] == LARGEST).all()
    assert np.sort(np.asarray(odds).ravel())[: -4 * 4].max() == -LARGEST
    assert (foreground_weights(odds)[0, 3:7, 3:7] == 1.0).all()
    assert float(foreground_weights(odds)[0, 0, 0]) == 0.0


def test_a_place_whose_background_was_never_seen_says_nothing():
    background = wall()
    background = replace(background, known=jnp.asarray(background.known).at[0, 4].set(False))
    odds = odds_of(seen(background, SHIRT), background, None)
    assert (odds[0, 4] == 0.0).all()
    assert (odds[0, 5, 3:7] > 1.0).all()


def test_a_faint_shadow_is_background_unless_it_is_a_subjects_colour():
    background = wall()
    dark = tuple(0.82 * c for c in WALL)
    in_shade = lambda whose: float(odds_of(seen(background, dark), background, whose)[0, 5, 5])
    assert in_shade(subject(SHIRT)) < -1.0
    assert in_shade(subject(dark)) > in_shade(subject(SHIRT)) + 0.5


def test_a_hand_over_a_floor_of_its_colour_is_undecided():
    """Neither certain background, as a plain difference has it, nor foreground."""
    floor = wall(color=SKIN)
    hand = np.add(SKIN, (0.03, -0.03, 0.02))
    certain = odds_of(seen(floor, hand), floor, subject(SHIRT))
    odds = odds_of(seen(floor, hand), floor, subject(SHIRT, SKIN))
    assert abs(float(odds[0, 5, 5])) < 1.5
    assert float(odds[0, 5, 5]) > float(certain[0, 5, 5]) + 0.5


@pytest.mark.slow
def test_nothing_is_held_against_a_shoe_on_a_floor_of_its_colour():
    floor, shoe = wall(color=(0.1, 0.1, 0.11)), (0.13, 0.13, 0.13)
    tables, empty = jnp.stack([subject(shoe), subject(SKIN)]), BackgroundModel.from_background(floor)
    cells = seen(floor, SKIN)
    known = jnp.ones(floor.known.shape)
    usual, told = (jax.jit(odds)(cells, known, empty, tables)[0] for odds in (cluster_odds, odds_where_told))
    assert float(usual[0, 10, 10]) < -1.0
    assert abs(float(told[0, 10, 10])) < 0.3
    assert float(told[1, 10, 10]) == float(usual[1, 10, 10]) == -LARGEST  # skin would be told
    np.testing.assert_array_equal(told[:, 3:7, 3:7], usual[:, 3:7, 3:7])


def test_slow_light_is_no_foreground():
    background = wall(color=WALL)
    shaded = background.colors * np.linspace(0.6, 1.2, 15)[None, None, :, None]
    textured = replace(background, colors=np.rint(shaded).astype(np.uint8))
    odds = odds_of(seen(textured, SHIRT, gain=1.15), textured, None)
    assert float(odds[0, 0].max()) < -1.0
    assert float(odds[0, 5, 5]) == LARGEST


@pytest.mark.parametrize("gain", [0.9, 1.0, 1.1])
@pytest.mark.parametrize("shown", [(0.11, 0.09, 0.09), (0.75, 0.57, 0.41), (0.3, 0.24, 0.17)])
def test_surprise_is_that_of_the_likelier_of_two_gaussians_about_the_background_in_the_frames_light(gain, shown):
    """In a brighter light dark trousers passed for a shadow once."""
    color, spread = np.array([140.0, 107.0, 77.0]) / 255.0, 0.028
    floor = replace(wall(color=color), spread=jnp.full((1, 12, 15), spread))
    found = background_surprise(seen(floor, shown, gain), BackgroundModel.from_background(floor))[0, 5, 5]
    expected = gain * color
    off = gain * np.array(shown) - expected

    def density(shadow):
        inverse = np.linalg.inv(spread**2 * np.eye(3) + shadow**2 * np.outer(expected, expected))
        volume = (2.0 * np.pi) ** 1.5 * np.sqrt(spread**4 * (spread**2 + shadow**2 * color @ color))
        return np.exp(-0.5 * off @ inverse @ off) / volume

    deep = 2.0 * SHADOWED * density(DEEP_SHADOW) if off @ expected < 0.0 else 0.0
    assert float(found) == pytest.approx(-np.log(max(density(SHADOW), deep)), rel=1e-3)


def test_a_deep_shadow_is_background_and_what_is_as_dark_but_of_another_hue_is_not():
    background = wall()
    of = lambda color, *whose: float(odds_of(seen(background, color), background, subject(*whose))[0, 5, 5])
    shade, other = 0.55 * np.array(WALL), 0.55 * np.array(WALL[::-1])
    assert of(shade, SHIRT, SKIN) < -0.5
    assert of(other, SHIRT, SKIN) == LARGEST
    assert of(shade, shade) > 0.2  # a sleeve of its colour is seen all the same
    assert of(1.45 * np.array(WALL), SHIRT) == LARGEST  # light is no shadow
    assert float(odds_of(seen(background, shade), background, None)[0, 5, 5]) == LARGEST  # it may be anybody's trousers


def test_windows_look_where_the_lens_put_things():
    """Odds that rise along the recorded picture, looked at from undistorted pixels; nothing outside it."""
    rig = ring_rig(2, distortion=(-0.2, 0.05, 1e-3, -2e-3, 0.01))
    side, (width, height) = 4, rig.image_size("cam0")
    columns = np.arange(width // side) * side + (side - 1) / 2.0
    odds = np.broadcast_to(columns / width, (2, height // side, width // side))
    box = np.array([[[[40.0, 30.0], [280.0, 210.0]]], [[[np.inf, np.inf], [-np.inf, -np.inf]]]])
    around = jax.jit(windows_around)
    windows = around(floats(odds), floats([side, side]), rig.cameras, floats(box))
    x, y = np.asarray(windows.x[0, 0], float), np.asarray(windows.y[0, 0], float)
    rays = np.linalg.inv(np.asarray(rig.camera("cam0").intrinsics, float)) @ np.stack(
        [np.repeat(x, len(y)), np.tile(y, len(x)), np.ones(x.size * y.size)]
    )
    pose = np.asarray(rig.camera("cam0").camera_from_world, float)
    world = np.linalg.inv(pose) @ np.concatenate([2.0 * rays, np.ones((1, rays.shape[1]))])
    recorded = opencv_pixels(rig, "cam0", world[:3].T)[:, 0].reshape(len(x), len(y))
    np.testing.assert_allclose(windows.odds[0, 0] * width, recorded, atol=side)
    assert (windows.odds[1] == 0.0).all()
    assert np.isfinite(np.asarray(windows.x)).all()
    outside = around(floats(odds), floats([side, side]), rig.cameras, floats(box[[0, 0]] + 5000.0))
    assert (outside.odds == 0.0).all()


def scene():
    """A body with random windows about it, in double precision."""
    body = random_body(4, joints=5, dofs=4, blobs=6)
    body = in_float64(eqx.tree_at(lambda b: b.blobs.offsets, body, body.blobs.offsets + jnp.array([[0.0, 0.0, 1.0]])))
    views = random_views(ring_rig(2).cameras, body, 0, count=8)
    rng = np.random.default_rng(0)
    grid = lambda count, low, high: floats(np.broadcast_to(np.linspace(low, high, count), (2, 1, count)))
    step = floats(np.broadcast_to([320.0 / (COLUMNS - 1), 240.0 / (ROWS - 1)], (2, 1, 2)))
    odds = floats(rng.uniform(-2.0, 2.0, (2, 1, COLUMNS, ROWS)))
    windows = Windows(grid(COLUMNS, 0.0, 320.0), grid(ROWS, 0.0, 240.0), step, odds)
    views = replace(views, windows=windows)
    pose = floats(body.poses["rest"]) + 0.1
    return body, Frame(views, History.unknown(pose)), pose


@eqx.filter_jit
def model(term, body, frame, pose):
    return term.quadratic(Posed.from_pose(body, pose), frame)


@eqx.filter_jit
def value(term, body, frame, pose):
    return term.value(Posed.from_pose(body, pose), frame)


def test_the_value_is_the_sum_over_all_cells():
    """Written out, cell by cell."""
    with jax.enable_x64(True):
        body, frame, pose = scene()
        views, windows = frame.views, frame.views.windows
        blobs = eqx.filter_jit(body.posed_blobs)(pose)
        total = 0.0
        for k in range(2):
            world, matrix = (np.asarray(a[k]) for a in (views.cameras.camera_from_world, views.cameras.intrinsics))
            points = np.asarray(blobs.means) @ world[:3, :3].T + world[:3, 3]
            pixels = (points / points[:, 2:]) @ matrix[:2].T
            sigmas = np.asarray(blobs.sigmas) * np.sqrt(matrix[0, 0] * matrix[1, 1]) / points[:, 2]
            width, height = np.asarray(windows.step[k, 0])
            covered = 0.0
            for pixel, sigma in zip(pixels, sigmas, strict=True):
                vx, vy = sigma**2 + width**2 / 12.0, sigma**2 + height**2 / 12.0
                dx, dy = np.asarray(windows.x[k, 0])[:, None] - pixel[0], np.asarray(windows.y[k, 0])[None] - pixel[1]
                covered += 2.0 * sigma**2 / np.sqrt(vx * vy) * np.exp(-(dx**2) / (2 * vx) - dy**2 / (2 * vy))
            gain = np.pi / 4.0 * width * height * np.asarray(windows.odds[k, 0])
            total += (gain * (1.0 - np.exp(-covered))).sum() / float(views.normalizers[k]) / 2.0
        found = float(value(Foreground(1.0), body, frame, pose))
        assert abs(found) > 1e-4
        assert found == pytest.approx(total, rel=1e-10)


def test_the_closed_form_is_the_gradient_and_the_springs_hold():
    with jax.enable_x64(True):
        body, frame, pose = scene()
        term = Foreground(0.7)
        energy = lambda pose: term.part(Posed.from_pose(body, pose), frame)
        found = model(term, body, frame, pose)
        expected, slope = jax.jit(jax.value_and_grad(energy))(pose)
        np.testing.assert_allclose(found.value, expected, rtol=1e-10)
        np.testing.assert_allclose(found.gradient, slope, rtol=1e-8, atol=1e-12)
        assert np.linalg.eigvalsh(found.curvature).min() > -1e-12
        assert np.trace(found.curvature) > 0.0


def test_without_a_background_the_term_is_nothing():
    with jax.enable_x64(True):
        body, frame, pose = scene()
        frame = replace(frame, views=replace(frame.views, windows=None))
        found = model(Foreground(1.0), body, frame, pose)
        assert float(found.value) == 0.0
        assert not np.any(found.gradient)
        assert not np.any(found.curvature)


def test_a_camera_without_a_picture_says_nothing():
    with jax.enable_x64(True):
        body, frame, pose = scene()
        windows = frame.views.windows
        one, two = (windows.of_present(jnp.array(present)) for present in ([True, False], [False, True]))
        seen = [replace(frame, views=replace(frame.views, windows=each)) for each in (one, two, windows)]
        both = [float(value(Foreground(1.0), body, each, pose)) for each in seen]
        assert both[0] + both[1] == pytest.approx(both[2])
        assert both[0] != both[2]
