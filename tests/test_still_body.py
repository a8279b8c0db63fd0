"""Somebody who stands still is told from the room by being seen in one colour from all sides."""

import cv2
import numpy as np
import pytest
from waving_person import OTHER_UPS, WavingPerson

from sogjax.scene.background import BackgroundImage
from sogjax.scene.floor import Floor, seen_floors
from sogjax.scene.still_body import Standing, heads_over, legs_of, still_bodies, with_room_behind


@pytest.fixture(scope="module")
def waving(tmp_path_factory):
    return WavingPerson.rendered(tmp_path_factory.mktemp("still") / "waving")


def found_in(waving, cameras, turn=None, floors=None):
    """What is found, in the recording's world or in one that is turned."""
    views = waving.seen(cameras, turn)
    return still_bodies(views, floors or {}), views.movements


@pytest.mark.slow
@pytest.mark.parametrize("by_floor", [False, True])
def test_legs_that_never_move_are_found_in_nearly_all_cameras(waving, by_floor):
    masks, movements = found_in(waving, range(8), floors=seen_floors(waving.seen(range(8))) if by_floor else None)
    surely, perhaps = ({k: mask[part] for k, mask in masks.items()} for part in (0, 1))
    assert waving.shown_at(surely, waving.knees).mean() > 0.8
    assert waving.shown_at(surely, waving.heads).mean() > 0.8
    assert np.mean([mask.mean() for mask in perhaps.values()]) < 0.055  # legs, trunk, head, and a rim
    assert all((surely[k] <= perhaps[k]).all() for k in masks)
    assert not any((perhaps[k] & movements[k]).any() for k in masks)


def test_furniture_is_nobody():
    """Legs, one leg, a leg of a table and something wide, 4 cm a voxel: the third is too narrow, the last too wide."""
    spacing, still = 0.04, np.zeros((64, 64, 30), bool)
    still[10:20, 10:18, :22] = still[2:5, 2:5, :22] = True
    still[30:60, 30:48, :22] = True
    still[50, 10, :20] = True
    legs = still.copy()
    legs[22:] = False
    np.testing.assert_array_equal(legs_of(still, 0.0, spacing), legs)


@pytest.mark.parametrize("leg", [0, 17])
def test_beside_a_table_legs_may_be_those_of_a_chair(leg):
    spacing, still = 0.04, np.zeros((64, 64, 30), bool)
    still[10:20, 10:18, :22] = True
    assert legs_of(still, 0.0, spacing).any()
    still[30:60, 30:48, 17:19] = still[30:32, 30:32, leg:19] = True
    assert not legs_of(still, 0.0, spacing).any()


def test_a_rail_is_no_table():
    spacing, still = 0.04, np.zeros((64, 64, 30), bool)
    still[10:20, 10:18, :22] = True
    alone = still.copy()
    still[30:60, 30:32, 17:19] = True
    np.testing.assert_array_equal(legs_of(still, 0.0, spacing), alone)


def test_a_head_is_over_what_moves_over_legs():
    """Somebody who stands still on two legs and moves the arms, and somebody who walks beside."""
    spacing = 0.05
    legs, moving = np.zeros((40, 40, 50), bool), np.zeros((40, 40, 50), bool)
    legs[8:12, 8:10, 2:18] = legs[8:12, 12:14, 2:18] = True
    moving[6:14, 6:16, 20:30] = True
    moving[28:34, 28:34, 2:36] = True
    heads = heads_over(legs, moving, spacing)
    middle = np.argwhere(heads).mean(axis=0)
    np.testing.assert_allclose(middle, (9.5, 10.5, 31.6), atol=0.6)
    assert np.ptp(np.argwhere(heads), axis=0).max() * spacing <= 0.35
    assert not heads_over(np.zeros_like(legs), moving, spacing).any()
    assert not heads_over(legs, np.zeros_like(moving), spacing).any()


@pytest.mark.slow
@pytest.mark.parametrize("turn", OTHER_UPS)
def test_whichever_axis_points_upwards_the_same_is_found(waving, turn):
    masks, others = found_in(waving, range(8))[0], found_in(waving, range(8), turn)[0]
    both = sum((masks[k].perhaps & others[k].perhaps).sum() for k in masks)
    either = sum((masks[k].perhaps | others[k].perhaps).sum() for k in masks)
    assert both > 0.85 * either


@pytest.mark.slow
def test_four_cameras_do_not_tell(waving):
    assert not any(mask.perhaps.any() for mask in found_in(waving, range(4))[0].values())


def test_the_room_goes_on_behind_somebody():
    room = np.full((60, 80, 3), (60, 120, 180), np.uint8)
    shown = room.copy()
    shown[20:50, 30:36] = (20, 20, 20)
    surely = np.zeros((60, 80), bool)
    surely[20:50, 30:40] = True  # the right half looks like the room
    perhaps = cv2.dilate(surely.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    nothing = np.zeros_like(surely)
    background = BackgroundImage(shown, np.full((60, 80), 2.0, np.float32), ~surely, "clip")
    found = with_room_behind(background, Standing(surely, perhaps), nothing, shown)
    assert np.abs(found.picture[22:48, 31:35].astype(int) - room[22:48, 31:35]).max() <= 3
    assert (found.spread[22:48, 31:35] > 5.0).all()
    assert found.known[22:48, :36].all()
    assert not found.known[22:48, 37:39].any()
    assert found.known[22:48, 40:].all()
    np.testing.assert_array_equal(found.picture[~surely], shown[~surely])
    assert with_room_behind(background, Standing(nothing, nothing), nothing, shown) is background


def test_behind_somebody_the_floor_is_as_other_cameras_show_it():
    shown = np.full((60, 80, 3), (60, 120, 180), np.uint8)
    planks = shown.copy()
    planks[:, 30:36] = (30, 60, 90)
    surely = np.zeros((60, 80), bool)
    surely[20:50, 30:40] = True
    background = BackgroundImage(shown, np.full((60, 80), 2.0, np.float32), ~surely, "clip")
    floor = Floor(planks, np.full((60, 80), 6.0, np.float32), np.ones((60, 80), bool), 0.0)
    found = with_room_behind(background, Standing(surely, surely), np.zeros_like(surely), shown, floor)
    np.testing.assert_array_equal(found.picture[22:48, 31:35], planks[22:48, 31:35])
    assert found.known[22:48, 31:35].all()
    assert not found.known[22:48, 37:39].any()  # it looks like the floor


@pytest.mark.slow
@pytest.mark.parametrize("cameras", [range(5), (0, 1, 2, 3, 7)])
def test_cameras_in_an_arc_do_not_take_a_floor_that_they_do_not_show_each_other_for_somebody(waving, cameras):
    floors = seen_floors(waving.seen(cameras))
    masks, _ = found_in(waving, cameras, floors=floors)
    assert floors
    assert np.mean([mask.perhaps.mean() for mask in masks.values()]) < 0.08
