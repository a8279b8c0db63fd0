"""Soft shadows against a disc that is cut by a straight edge."""

import numpy as np
import pytest

from sogjax.synth.figure import Mesh
from sogjax.synth.light import UP, ShadowMap

SPREAD = 0.1


@pytest.fixture(scope="module")
def shadow():
    """Of a square of two metres, a metre over the floor, lit from above."""
    corners = np.array([[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [1.0, 1.0, 1.0], [-1.0, 1.0, 1.0]])
    mesh = Mesh(corners, np.tile(UP, (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]))
    return ShadowMap.of([mesh], UP, spacing=0.01, spread=SPREAD)


def test_the_share_of_the_lamp_at_an_edge_is_that_of_a_disc_beyond_it(shadow):
    beyond = np.linspace(-2.0 * SPREAD, 2.0 * SPREAD, 81)
    points = np.stack([1.0 + beyond, np.full(81, 0.2), np.zeros(81)], axis=1)
    cosine = np.clip(-beyond / SPREAD, -1.0, 1.0)
    disc = (np.arccos(cosine) - cosine * np.sqrt(1.0 - cosine**2)) / np.pi
    np.testing.assert_allclose(shadow.lit(points, taps=2000), disc, atol=0.08)  # a cell is a tenth of the spread


@pytest.mark.parametrize(
    ("point", "share"),
    [((0.3, -0.2, 0.0), 0.0), ((1.5, 0.0, 0.0), 1.0), ((40.0, -70.0, 0.0), 1.0), ((0.3, 0.2, 1.0), 1.0)],
)
def test_under_it_is_darkness_and_light_beside_it_far_away_and_on_it(shadow, point, share):
    assert shadow.lit(np.array([point])) == share


def test_points_that_are_not_looked_at_closely_have_the_share_of_all_taps(shadow):
    points = np.random.default_rng(1).uniform([-1.5, -1.5, -0.2], [1.5, 1.5, 1.1], (20_000, 3))
    local = ((points @ shadow.axes) - shadow.origin).astype(np.float32)
    places = local[:, :2].T * np.float32(1.0 / shadow.spacing)
    every = shadow._tapped(places, local[:, 2] - np.float32(shadow.bias), 8)
    np.testing.assert_array_equal(shadow.lit(points), every)


def test_where_nothing_is_nothing_is_dark():
    np.testing.assert_array_equal(ShadowMap.of([]).lit(np.random.default_rng(0).normal(size=(50, 3))), 1.0)
