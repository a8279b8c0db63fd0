"""Places where a body may be, in voxels that look more or less like it."""

import numpy as np
import pytest
from body_cases import shipped

from sogjax.search.placed_body import turns_with_vertical, uprightness
from sogjax.search.places import places_among

SPACING = 0.1
AXES = [np.arange(-15, 16) * SPACING, np.arange(-15, 16) * SPACING, np.arange(-3, 22) * SPACING]
GRID = np.stack(np.meshgrid(*AXES, indexing="ij"), axis=-1)
FIRST, SECOND = np.array([0.4, 0.1, 0.9]), np.array([-0.4, -0.1, 0.85])


def of_people(*middles, shadows=0.0):
    """Voxels of people who stand there, in their shadows on the floor."""
    scores = np.full(GRID.shape[:3], -1.0)
    if shadows:
        off = np.linalg.norm(GRID[..., :2] - 0.2, axis=-1)
        scores[(off < shadows) & (np.abs(GRID[..., 2]) < 0.12)] = 1.5
    for middle in middles:
        off = GRID - middle
        scores[(np.linalg.norm(off[..., :2], axis=-1) < 0.2) & (np.abs(off[..., 2]) < 0.9)] = 1.5
    return scores


def found(scores, among, up="z", grid=GRID):
    return [place.centre for place in places_among(grid, SPACING, scores, up, 4, among)]


def test_who_stands_in_shadows_is_looked_for_where_he_stands():
    first, second = found(of_people(FIRST, SECOND, shadows=0.6), 2)[:2]
    near = [np.linalg.norm(first - middle) for middle in (FIRST, SECOND)]
    assert min(near) < 0.2
    assert np.linalg.norm(second - (SECOND if near[0] < near[1] else FIRST)) < 0.2


def test_two_who_touch_are_two_places():
    one, other = np.array([0.22, 0.0, 0.9]), np.array([-0.22, 0.0, 0.9])
    places = found(of_people(one, other), 2)[:2]
    assert min(np.linalg.norm(places[0] - one), np.linalg.norm(places[1] - one)) < 0.15
    assert min(np.linalg.norm(places[0] - other), np.linalg.norm(places[1] - other)) < 0.15


@pytest.mark.parametrize("up", ["x", "y"])
def test_the_vertical_may_be_any_axis(up):
    turn = {"x": [2, 0, 1], "y": [1, 2, 0]}[up]
    scores = of_people(FIRST, SECOND, shadows=0.6)
    turned = np.transpose(scores, turn), np.transpose(GRID, [*turn, 3])[..., turn]
    for here, there in zip(found(scores, 2), found(turned[0], 2, up, turned[1]), strict=True):
        np.testing.assert_allclose(here[turn], there, atol=1e-9)


def test_what_looks_less_like_a_body_is_no_place():
    assert len(found(of_people(FIRST), 2)) <= 3
    assert all(np.linalg.norm((place - FIRST)[:2]) < 0.3 for place in found(of_people(FIRST), 2))


def test_nothing_is_nowhere():
    assert found(np.full(GRID.shape[:3], -1.0), 2) == []


def test_who_stands_on_his_head_is_not_upright():
    human = shipped("human")
    up = np.array([0.0, 0.0, 1.0])
    rest = np.asarray(human.poses["rest"])
    heads_down = turns_with_vertical(human, [rest], up, -up)
    assert (uprightness(human, heads_down, "z") < -0.9).all()
    assert uprightness(human, rest[None], "z") == pytest.approx([1.0], abs=1e-5)
    assert len(heads_down) > 3
