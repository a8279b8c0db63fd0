"""Who stands where the background is not known, by colours that the cameras share."""

import cv2
import numpy as np
import pytest
from test_segmentation import UP, iou, who_hardly_moves

from sogjax.scene.background import BackgroundImage
from sogjax.scene.subject_colors import Scene, decided_together, subject_colors

CAMERAS = 6


def whole(rig):
    return {k: rig.camera(name) for k, name in enumerate(rig.names)}


def nothing(masks):
    return {k: np.zeros_like(mask) for k, mask in masks.items()}


def alone(scene, rig):
    """What the colours say that all cameras share, in each by itself."""
    colors = subject_colors([scene], whole(rig), UP)
    assert colors is not None
    return {k: colors.decided(k, scene) for k in scene.unknown}


def together(scene, rig):
    """What they say of all cameras together."""
    found = decided_together(scene, whole(rig), UP)
    assert found is not None
    return found


WAYS = pytest.mark.parametrize("way", [alone, together])


@WAYS
def test_colours_before_all_walls_are_the_subject(way):
    """Nothing is certain: who stands in a pillar of the room is told by his colours alone, seen in one moment."""
    rig, pictures, truth, _, pillars = who_hardly_moves(CAMERAS)
    scene = Scene(pictures, nothing(truth), pillars, nothing(truth))
    found = way(scene, rig)
    for k, mask in truth.items():
        subject, untold, _ = found[k]
        assert iou(subject, mask) > 0.85, k
        assert (untold & ~mask).sum() < 0.02 * (pillars[k] & ~mask).sum(), k


@WAYS
def test_what_one_camera_alone_shows_is_not_taken_for_the_subject(way):
    """A board as wide as the pillar, in front of one camera: neither the room beside nor the others have its colour."""
    rig, pictures, truth, _, pillars = who_hardly_moves(CAMERAS)
    board = pillars[2] & (np.arange(len(pillars[2])) > 0.7 * len(pillars[2]))[:, None]
    pictures[2] = np.where(board[..., None], np.array([40, 230, 40], np.uint8), pictures[2])
    scene = Scene(pictures, nothing(truth), pillars, nothing(truth))
    found = way(scene, rig)
    inner = board.copy()
    inner[: np.nonzero(board)[0].min() + 4] = False
    assert not found[2].subject[inner].any()
    for k in set(truth) - {2}:
        assert iou(found[k].subject, truth[k]) > 0.85, k


def test_who_looks_like_the_wall_to_one_camera_is_told_by_the_others():
    """Patches of one wall have his colours: that camera alone takes them for him, or him for the wall."""
    rig, pictures, truth, _, pillars = who_hardly_moves(CAMERAS)
    rng, own, size = np.random.default_rng(0), pictures[3][truth[3]], truth[3].shape[::-1]
    patches = np.where(rng.random((30, 40, 1)) < 0.2, own[rng.integers(len(own), size=(30, 40))], 0)
    wall = cv2.resize(patches.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST)
    pictures[3] = np.where(((wall > 0).any(axis=-1) & ~truth[3])[..., None], wall, pictures[3])
    scene = Scene(pictures, nothing(truth), pillars, nothing(truth))
    found = together(scene, rig)
    assert iou(alone(scene, rig)[3].subject, truth[3]) < 0.6
    for k, mask in truth.items():
        assert iou(found[k].subject, mask) > 0.75, k
        assert found[k].possible[mask].mean() > 0.85, k
        assert found[k].possible[~mask].sum() < 0.4 * mask.sum(), k


@pytest.mark.parametrize(("cameras", "tables"), [(4, ()), (CAMERAS, (0, 2, 4, 5))])
def test_few_cameras_decide_alone_and_so_do_those_beside_furniture(cameras, tables):
    """Of four none may be wrong about a place, which each is somewhere; legs behind a table are seen by few."""
    rig, pictures, truth, _, pillars = who_hardly_moves(cameras)
    low = {k: pillars[k] & (np.arange(len(pillars[k])) > 0.7 * len(pillars[k]))[:, None] for k in tables}
    scene = Scene(pictures, nothing(truth), pillars, nothing(truth) | low)
    by_itself, found = alone(scene, rig), together(scene, rig)
    for k in truth:
        np.testing.assert_array_equal(found[k], by_itself[k])


@pytest.mark.slow
@WAYS
def test_what_never_moves_is_not_taken_for_the_subject(way):
    """A table before everybody's legs, of a colour that no room has, in all cameras."""
    rig, pictures, truth, _, pillars = who_hardly_moves(CAMERAS)
    table = {k: pillar & (np.arange(len(pillar)) > 0.7 * len(pillar))[:, None] for k, pillar in pillars.items()}
    pictures = {
        k: np.where(table[k][..., None], np.array([40, 230, 40], np.uint8), image) for k, image in pictures.items()
    }
    for calm in (nothing(truth), table):
        scene = Scene(pictures, nothing(truth), pillars, calm)
        found = way(scene, rig)
        for k, mask in truth.items():
            subject, untold, _ = found[k]
            if calm is table:
                assert iou(subject, mask & ~table[k]) > 0.85, k
                assert untold[table[k]].all()
            else:
                assert subject[table[k]].mean() > 0.5, k


def test_only_what_is_unknown_and_never_moves_beside_furniture_is_calm():
    spread = np.full((40, 60), 3.0, np.float32)
    known = np.ones((40, 60), bool)
    known[:, 30:] = False
    spread[20:, 30:] = 6.0
    picture = np.zeros((40, 60, 3), np.uint8)
    calm = BackgroundImage(picture, spread, known, "clip", furnished=True).calm
    assert calm[:16, 34:].all()
    assert not calm[24:].any()
    assert not calm[:, :30].any()
    assert not BackgroundImage(picture, spread, known, "clip").calm.any()
    assert not BackgroundImage(picture, spread, np.zeros_like(known), "clip", furnished=True).calm.any()


def test_furniture_stays_calm_where_a_background_that_is_learnt_again_knows_nothing():
    spread, known = np.full((40, 60), 3.0, np.float32), np.ones((40, 60), bool)
    known[:, 30:], spread[20:, 30:] = False, 6.0
    first = BackgroundImage(np.zeros((40, 60, 3), np.uint8), spread, known, "clip", furnished=True)
    left_out = np.ones_like(known)
    left_out[:, 40:] = False  # where the body was believed to be, no sample tells how far colours vary
    again = BackgroundImage(first.picture, np.full_like(spread, 3.0), left_out, "clip").filled(first).calm_as(first)
    assert again.furnished
    assert again.known[:, :40].all()
    assert not again.known[:, 40:].any()
    assert again.calm[:16, 44:].all()
    assert not again.calm[24:].any()


def test_a_camera_that_shows_no_room_tells_nothing():
    rig, pictures, truth, _, pillars = who_hardly_moves(CAMERAS)
    unknown = {**pillars, 1: np.ones_like(pillars[1])}
    scene = Scene(pictures, nothing(truth), unknown, nothing(truth))
    colors = subject_colors([scene], whole(rig), UP)
    assert colors is not None
    if 1 not in colors.odds:  # else its hull leaves some of the picture to the room
        subject, untold, _ = colors.decided(1, scene)
        assert not subject.any()
        assert untold.all()
    for k in set(truth) - {1}:
        assert iou(colors.decided(k, scene)[0], truth[k]) > 0.85, k


def test_pictures_without_anybody_tell_nothing():
    rig, pictures, truth, _, _ = who_hardly_moves(CAMERAS)
    assert subject_colors([Scene(pictures, nothing(truth), nothing(truth), nothing(truth))], whole(rig), UP) is None
    assert subject_colors([], whole(rig), UP) is None
    assert decided_together(Scene(pictures, nothing(truth), nothing(truth), nothing(truth)), whole(rig), UP) is None
