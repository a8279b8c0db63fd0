"""The floor behind somebody who stands on it all the time, from what the other cameras see of it."""

from dataclasses import replace

import cv2
import equinox as eqx
import numpy as np
import pytest
from waving_person import OTHER_UPS, WavingPerson

from sogjax.scene.background import BackgroundImage
from sogjax.scene.coarse_views import CoarseViews
from sogjax.scene.floor import Floor, over_floor, seen_floors, with_floor
from sogjax.scene.still_zone import standing_zones

CAMERAS = range(8)


@pytest.fixture(scope="module")
def waving(tmp_path_factory):
    return WavingPerson.rendered(tmp_path_factory.mktemp("floor") / "waving")


@pytest.fixture(scope="module")
def floors(waving):
    return seen_floors(waving.seen(CAMERAS))


def on_floor(waving, floors, pictures):
    """Where each camera shows the floor, and where it shows something else before it, at its pictures' size."""
    shown = {k: floor.shown(pictures[k]) for k, floor in floors.items()}
    return shown, {k: floor.known & ~shown[k] for k, floor in floors.items()}


@pytest.mark.slow
def test_legs_are_told_from_the_floor_that_the_other_cameras_see_behind_them(waving, floors):
    shown, hidden = on_floor(waving, floors, waving.seen(CAMERAS).pictures)
    assert sorted(floors) == list(CAMERAS)
    assert all(abs(floor.height) < 0.03 for floor in floors.values())
    below = waving.knees - np.array([0.0, 0.0, 0.15], np.float32)
    assert not waving.shown_at(shown, below).any()
    assert waving.shown_at(hidden, below).mean() > 0.8
    assert np.mean([shown[k].sum() / floors[k].known.sum() for k in floors]) > 0.85


@pytest.mark.slow
@pytest.mark.parametrize("turn", OTHER_UPS)
def test_whichever_axis_points_upwards_the_same_floor_is_found(waving, floors, turn):
    turned = seen_floors(waving.seen(CAMERAS, turn))
    assert sorted(turned) == list(CAMERAS)
    for k, floor in turned.items():
        both = floor.known & floors[k].known
        assert both.sum() > 0.95 * floors[k].known.sum()
        assert np.abs(floor.picture[both].astype(int) - floors[k].picture[both]).mean() < 2.0


@pytest.mark.slow
def test_a_camera_in_another_light_sees_the_floor_in_its_own(waving, floors):
    views = waving.seen(CAMERAS)
    darker = views.pictures | {2: cv2.convertScaleAbs(views.pictures[2], alpha=0.7)}
    found = seen_floors(replace(views, pictures=darker))
    for k in (2, 3):
        shown, before = found[k].shown(darker[k]), floors[k].shown(views.pictures[k])
        assert (shown & before).sum() > 0.9 * before.sum()


@pytest.mark.slow
def test_a_floor_without_a_pattern_or_with_few_cameras_is_not_told(waving):
    views = waving.seen(CAMERAS)
    assert seen_floors(waving.seen(range(3))) == {}
    grey = {k: np.full_like(one, 90) for k, one in views.pictures.items()}
    assert seen_floors(replace(views, pictures=grey)) == {}


@pytest.mark.slow
def test_voxels_of_legs_are_not_over_floor_and_what_stands_over_them_may_be_somebody(waving, floors):
    views = waving.seen(CAMERAS)
    empty, _, ground = over_floor(views, floors)
    places = np.rint((waving.knees - [0.0, 0.0, 0.15] - views.cube.points[0]) / views.cube.spacing).astype(int)
    assert not empty[tuple(places.T)].any()
    low = empty[:, :, ground + 1 : ground + 5]
    assert 0.5 < low.mean() < 1.0
    everywhere = {k: np.ones_like(mask) for k, mask in views.movements.items()}
    zones = standing_zones(everywhere, views, floors)
    assert waving.shown_at(zones, waving.knees).mean() > 0.9
    assert np.mean([mask.mean() for mask in zones.values()]) < 0.6


def test_the_floor_is_the_background_where_samples_show_it_and_nothing_is_where_none_do():
    boards = np.tile(np.array([60, 110], np.uint8).repeat(4), (48, 8))[..., None].repeat(3, axis=-1)
    film = [boards.copy() for _ in range(10)]
    for k, image in enumerate(film):
        image[10:30, 20:30] = 200  # stands all the time
        if k < 6:
            image[10:30, 40:50] = 200  # stands for most of it
    learnt = BackgroundImage(film[0], np.full((48, 64), 2.0, np.float32), np.ones((48, 64), bool), "clip")
    zone = np.zeros((48, 64), bool)
    zone[:, 16:] = True
    found = with_floor(
        learnt, Floor(boards, np.full((48, 64), 6.0, np.float32), np.ones((48, 64), bool), 0.0), film, zone
    )
    assert not found.known[12:28, 22:28].any()
    assert found.known[10:30, 40:50].all()
    np.testing.assert_array_equal(found.picture[10:30, 40:50], boards[10:30, 40:50])
    assert (found.spread[10:30, 40:50] >= 3.0).all()
    np.testing.assert_array_equal(found.picture[:, :16], learnt.picture[:, :16])


@pytest.mark.slow
def test_four_cameras_are_enough(waving):
    assert sorted(seen_floors(waving.seen(range(0, 8, 2)))) == [0, 2, 4, 6]


@pytest.mark.slow
def test_where_pictures_show_no_floor_somebody_may_stand_near_what_moves(waving):
    views, cut = waving.seen(CAMERAS), {}
    for k, mask in views.movements.items():
        rows = len(mask) if k > 2 else round(0.55 * len(mask))
        size = np.array([mask.shape[1], rows], np.float32)
        camera = eqx.tree_at(lambda c: c.image_size, views.cameras[k], size)
        cut[k] = mask[:rows], views.pictures[k][:rows], camera
    parts = [{k: one[part] for k, one in cut.items()} for part in range(3)]
    seen = CoarseViews.of(*parts, views.up)
    assert seen is not None
    zones = standing_zones({k: np.ones_like(mask) for k, mask in parts[0].items()}, seen, seen_floors(seen))
    assert waving.shown_at({k: zones[k] for k in range(3, 8)}, waving.knees).mean() > 0.7


def test_a_picture_larger_than_the_floor_has_no_dark_rim():
    boards, known = np.full((243, 324, 3), 150, np.uint8), np.zeros((243, 324), bool)
    known[:, :162] = True
    samples = [np.full((486, 648, 3), 150, np.uint8)] * 10
    nothing = BackgroundImage.nothing(648, 486)
    floor = Floor(boards, np.full((243, 324), 6.0, np.float32), known, 0.0)
    found = with_floor(nothing, floor, samples, np.ones((486, 648), bool))
    assert found.known.sum() == 486 * 324
    assert (found.picture[found.known] == 150).all()
