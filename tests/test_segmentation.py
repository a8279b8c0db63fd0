"""Masks from pictures of the empty scene: exposure, shadows, several cameras; masks that do not fit the others."""

import cv2
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, shipped
from drawn_scene import draw, in_colors, standing
from rig_cases import opencv_pixels, ring_rig
from slow_values import fast_and_slow

from sogjax.model.camera import distort, project_points
from sogjax.scene.background_difference import background_difference
from sogjax.scene.coarse_views import CoarseViews
from sogjax.scene.segmentation import masks_from_backgrounds
from sogjax.scene.still_zone import still_zones
from sogjax.scene.visual_hull import (
    VOXELS,
    Cube,
    cube_around,
    disagreeing_cameras,
    hull_coverage,
    resized,
    voxel_pixels,
    without_floor,
)

UP = np.array([0.0, 0.0, 1.0])
FLESH = 1.5
CENTRE, RADIUS = np.array([0.1, -0.05, 1.1]), 0.3


def scene(size=(320, 240), seed=0, contrast=25.0):
    """A wall with a pattern at every scale (float BGR)."""
    rng = np.random.default_rng(seed)
    width, height = size
    image = np.full((height, width, 3), (90.0, 105.0, 120.0))
    for cell in (3, 9, 27):
        coarse = rng.normal(size=(height // cell + 2, width // cell + 2, 1)) * contrast / 2
        image += cv2.resize(np.repeat(coarse, 3, -1), size, interpolation=cv2.INTER_CUBIC)
    return np.clip(image, 20, 230)


def photo(light, seed=1, gain=1.0, offset=0.0, noise=2.0):
    """What a camera makes of it."""
    light = gain * light + offset + np.random.default_rng(seed).normal(size=light.shape) * noise
    return np.clip(np.rint(light), 0, 255).astype(np.uint8)


def iou(a, b):
    return (a & b).sum() / (a | b).sum()


@pytest.mark.parametrize(("gain", "offset"), [(1.0, 0.0), (0.75, 10.0), ((1.2, 1.0, 0.9), -5.0)])
def test_another_exposure_is_no_difference(gain, offset):
    empty = scene()
    found = background_difference(photo(empty, 2, np.array(gain), offset), photo(empty, 1))
    assert found.different.mean() < 1e-3
    assert found.changed.mean() < 1e-3


def test_a_shadow_is_no_other_colour_and_told_by_its_pattern():
    empty = scene()
    box = (slice(60, 180), slice(100, 220))
    shaded = empty.copy()
    shaded[box] *= 0.6
    found = background_difference(photo(shaded, 2), photo(empty, 1))
    inside = (slice(70, 170), slice(110, 210))
    assert found.different[inside].mean() < 0.02
    assert found.changed[inside].mean() < 0.3
    assert (found.change[inside] > 8.0).mean() > 0.9


@pytest.mark.parametrize(("learnt", "is_other"), [(True, False), (False, True)])
def test_what_was_learnt_in_a_shadow_and_is_lit_again_is_no_other_colour(learnt, is_other):
    shaded, lit = scene(), scene()
    shaded[60:180, 100:220] *= 0.7
    found = background_difference(photo(lit, 2), photo(shaded, 1), learnt=learnt)
    share = found.different[70:170, 110:210].mean()
    assert share > 0.8 if is_other else share < 0.02


def test_what_is_far_brighter_than_a_learnt_background_is_another_colour():
    empty = scene()
    shirt = empty.copy()
    shirt[60:180, 100:220] = 2.2 * empty.mean(axis=(0, 1))
    found = background_difference(photo(shirt, 2), photo(empty, 1), learnt=True)
    assert found.different[70:170, 110:210].mean() > 0.9


def test_a_darker_thing_without_the_pattern_is_a_change_but_may_be_a_shadow():
    empty = scene(contrast=8.0)
    thing = empty.copy()
    thing[60:180, 100:220] = 0.6 * empty.mean(axis=(0, 1))
    found = background_difference(photo(thing, 2), photo(empty, 1))
    assert found.changed[70:170, 110:210].mean() > 0.9


def shadow_on_floor(rig, name, image, height):
    """Darken an ellipse of the floor, at a height in metres, as the camera sees it."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    rim = np.stack([0.35 * np.cos(angle), 0.12 + 0.1 * np.sin(angle), np.full(60, height)], axis=-1)
    inside = np.zeros(image.shape[:2], np.uint8)
    cv2.fillPoly(inside, [np.rint(opencv_pixels(rig, name, rim)).astype(np.int32)], 1)
    shade = cv2.GaussianBlur(inside.astype(float), (0, 0), 1.5)
    return (1.0 - 0.4 * shade[..., None]) * image


@pytest.mark.parametrize("num_cameras", [3, 6])
def test_masks_of_a_body_with_its_shadow(num_cameras):
    """Drawn discs before a pattern, lens distortion, another exposure."""
    rig = ring_rig(num_cameras, distance=2.0)
    body = in_colors(shipped("dog"))
    pose = standing(body, 1.2)
    floor = float(posed(body, jnp.asarray(pose))[0].means[:, 2].min()) - 0.02
    truth = dict(enumerate(draw(body, pose, rig, masks=True, disc=FLESH)))
    drawn = draw(body, pose, rig, disc=FLESH)
    images, plates = {}, {}
    for k, name in enumerate(rig.names):
        empty = scene(seed=k, contrast=10.0)
        light = np.where(truth[k][..., None], drawn[k], shadow_on_floor(rig, name, empty, floor))
        images[k], plates[k] = photo(light, k, 1.1, -6.0), photo(empty, 50 + k)
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    known = {0: truth[0]}
    for given in ({}, known):
        wanted = {k: plates[k] for k in plates if k not in given}
        masks = masks_from_backgrounds(images, wanted, given, cameras, UP).masks
        assert set(masks) == set(wanted)
        for k, mask in masks.items():
            assert mask.shape == truth[k].shape
            assert iou(mask, truth[k]) > 0.82, k


def test_legs_that_never_moved_are_told_from_an_unknown_floor_by_their_colours():
    """The lower half of a person is in the picture of the empty scene too, so nothing is known around it."""
    rig = ring_rig(6, distance=3.0)
    body = in_colors(shipped("human"))
    pose = standing(body, 0.9)
    middle = float(np.median(np.asarray(posed(body, jnp.asarray(pose))[0].means)[:, 2])) - 0.2
    truth, drawn = draw(body, pose, rig, masks=True, disc=FLESH), draw(body, pose, rig, disc=FLESH)
    images, plates, unknown = {}, {}, {}
    for k, name in enumerate(rig.names):
        empty, mask = scene(seed=k, contrast=10.0), truth[k]
        row = int(opencv_pixels(rig, name, np.array([[0.0, 0.0, middle]]))[0, 1])
        still = mask & (np.arange(len(mask)) > row)[:, None]
        assert still.sum() > 0.2 * mask.sum()
        unknown[k] = cv2.dilate(still.astype(np.uint8), np.ones((21, 21))) > 0
        images[k] = photo(np.where(mask[..., None], drawn[k], empty), k)
        plates[k] = photo(np.where(still[..., None], drawn[k], empty), 50 + k)
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    masks = masks_from_backgrounds(images, plates, {}, cameras, UP, unknown).masks
    assert min(iou(masks[k], truth[k]) for k in images) > 0.8


def who_hardly_moves(num_cameras):
    """Somebody of whom only the arms move, before walls with patterns: pictures, silhouettes, arms, pillars around."""
    rig = ring_rig(num_cameras, distance=3.0)
    body = in_colors(shipped("human"))
    pose = standing(body, 0.9)
    truth, drawn = draw(body, pose, rig, masks=True, disc=FLESH), draw(body, pose, rig, disc=FLESH)
    truth = dict(enumerate(truth))
    pictures, arms, pillars = {}, {}, {}
    for k in range(num_cameras):
        mask = truth[k]
        pictures[k] = photo(np.where(mask[..., None], drawn[k], scene(seed=k, contrast=10.0)), k)
        rows, columns = np.nonzero(mask)
        upper = np.zeros_like(mask)
        upper[rows.min() + len(mask) // 12 : (rows.min() + rows.max()) // 2] = True
        arms[k] = mask & upper
        pillars[k] = np.zeros_like(mask)
        pillars[k][:, max(columns.min() - 40, 0) : columns.max() + 40] = True
    return rig, pictures, truth, arms, pillars


@pytest.mark.parametrize("num_cameras", fast_and_slow(4, 8))
def test_who_stands_still_in_a_pillar_of_the_room_is_told_by_colour(num_cameras):
    rig, pictures, truth, arms, pillars = who_hardly_moves(num_cameras)
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    views = CoarseViews.of(arms, pictures, cameras, UP)
    assert views is not None
    narrow, still = still_zones(pillars, views)
    for k, mask in truth.items():
        assert (still[k] & mask).sum() > 0.95 * mask.sum(), k
        assert still[k].sum() < 0.6 * pillars[k].sum(), k
        assert not (narrow[k] & ~still[k]).any()
        assert (narrow[k] & mask).sum() > 0.9 * mask.sum(), k
        assert narrow[k].sum() < 0.9 * still[k].sum(), k


def test_who_stands_where_nothing_is_known_gets_masks_by_colour():
    rig, pictures, truth, _, pillars = who_hardly_moves(6)
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    masks = masks_from_backgrounds(pictures, pictures, {}, cameras, UP, pillars).masks
    assert set(masks) == set(truth)
    assert min(iou(masks[k], truth[k]) for k in masks) > 0.8


def test_masks_that_are_given_tell_the_colours_of_who_is_not_known_elsewhere():
    rig, pictures, truth, _, pillars = who_hardly_moves(6)
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    given = {k: mask for k, mask in truth.items() if k}
    masks = masks_from_backgrounds(pictures, {0: pictures[0]}, given, cameras, UP, {0: pillars[0]}).masks
    assert iou(masks[0], truth[0]) > 0.8


def test_a_plate_of_another_place_gives_no_mask():
    rig = ring_rig(2)
    images = {k: photo(scene(seed=k, contrast=60.0)) for k in range(2)}
    plates = {k: photo(scene(seed=k + 10, contrast=60.0)) for k in range(2)}
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    assert masks_from_backgrounds(images, plates, {}, cameras, UP).masks == {}


def sphere_masks(num_cameras=5):
    """The silhouettes of a sphere: pixels whose rays pass its centre by less than its radius."""
    rig = ring_rig(num_cameras, distortion=(0.0,) * 5)
    masks = {}
    for k, name in enumerate(rig.names):
        camera, (width, height) = rig.camera(name), rig.image_size(name)
        matrix, pose = np.asarray(camera.intrinsics, float), np.asarray(camera.camera_from_world, float)
        rows, columns = np.mgrid[:height, :width]
        rays = np.stack([columns, rows, np.ones_like(rows)], -1) @ np.linalg.inv(matrix).T
        rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
        centre = pose[:3, :3] @ CENTRE + pose[:3, 3]
        masks[k] = np.linalg.norm(np.cross(rays, centre), axis=-1) < RADIUS
    return masks, {k: rig.camera(name) for k, name in enumerate(rig.names)}


def test_the_cube_holds_the_subject_even_if_one_mask_is_wrong():
    masks, cameras = sphere_masks()
    for wrong in (None, 2):
        if wrong is not None:
            masks[wrong] = np.roll(masks[wrong], 90, axis=1)
        cube = cube_around([*masks.values()], [*cameras.values()])
        np.testing.assert_allclose(cube.centre, CENTRE, atol=0.06)
        assert abs(cube.size - 2.0 * RADIUS) < 0.08


def test_voxels_lie_where_the_camera_sees_them():
    _, cameras = sphere_masks()
    camera = cameras[1]
    cube = Cube(CENTRE, 0.5)
    found = voxel_pixels(cube, camera, (240, 320))
    pixels = distort(camera, project_points(camera, jnp.asarray(cube.points[::997], jnp.float32))[0])
    np.testing.assert_allclose(found.columns[::997], pixels[:, 0], atol=0.51)
    np.testing.assert_allclose(found.rows[::997], pixels[:, 1], atol=0.51)


def test_the_middle_of_voxels_is_the_mean_of_their_centres():
    cube, some = Cube(CENTRE, 0.5), np.random.default_rng(0).random(64**3) < 0.1
    np.testing.assert_allclose(cube.middle(some), cube.points[some].mean(axis=0), atol=1e-9)


def test_a_camera_of_smaller_pictures_sees_the_same_points():
    _, cameras = sphere_masks()
    camera, half = cameras[0], resized(cameras[0], (160, 120))
    points = jnp.asarray(np.random.default_rng(0).normal(size=(20, 3)) * 0.3 + CENTRE, jnp.float32)
    full, small = (np.asarray(project_points(c, points)[0]) for c in (camera, half))
    np.testing.assert_allclose((full + 0.5) / 2.0 - 0.5, small, atol=1e-3)


@pytest.mark.parametrize("up", [UP, -UP, np.array([0.0, 1.0, 0.0])])
def test_what_lies_flat_on_the_floor_does_not_stand(up):
    axis, sign = int(np.argmax(np.abs(up))), np.sign(up.sum())
    cube = Cube(CENTRE, 1.0)
    offset = cube.points - CENTRE
    height, aside = sign * offset[:, axis], offset[:, (axis + 1) % 3]
    column = np.abs(offset).max(axis=1) < 0.4
    column &= np.abs(aside) < 0.1
    slab = (height > -0.4) & (height < -0.32) & (np.abs(aside) < 0.5)
    arm = (np.abs(height) < 0.05) & (np.abs(aside) < 0.5)
    kept = without_floor(column | slab | arm, up)
    assert kept[column | arm].all()
    assert not kept[slab & (np.abs(aside) > 0.15)].any()
    assert kept.shape == (VOXELS**3,)


def test_masks_that_show_one_thing_agree():
    masks, cameras = sphere_masks()
    assert disagreeing_cameras(masks, cameras) == {}
    assert min(hull_coverage(masks, cameras).values()) > 0.95
    assert disagreeing_cameras({k: masks[k] for k in (0, 2)}, cameras) == {}


def lower_half_missing(mask):
    rows = np.nonzero(mask)[0]
    mask = mask.copy()
    mask[(rows.min() + rows.max()) // 2 :] = False
    return mask


def much_more(mask):
    mask = mask.copy()
    mask[:, -90:] = True
    return mask


@pytest.mark.parametrize("blunder", [lower_half_missing, much_more, lambda mask: np.roll(mask, 90, axis=1)])
def test_a_mask_that_shows_something_else_is_found(blunder):
    masks, cameras = sphere_masks()
    masks[1] = blunder(masks[1])
    assert list(disagreeing_cameras(masks, cameras)) == [1]
    assert min(hull_coverage(masks, cameras).values()) < 0.7
    assert list(disagreeing_cameras({k: masks[k] for k in (0, 1)}, cameras)) == []


def test_three_cameras_tell_which_mask_lacks_a_part():
    masks, cameras = sphere_masks(3)
    masks[1] = lower_half_missing(masks[1])
    assert list(disagreeing_cameras(masks, cameras)) == [1]


@pytest.mark.parametrize("corner", [(2, 2), (106, 2), (2, 140), (106, 140)])
def test_undecided_masks_hold_nothing_that_is_unknown(corner):
    """One camera's subject is wholly unknown, and a lamp shines elsewhere in its picture."""
    body = in_colors(shipped("dog"))
    rig = ring_rig(4, (160, 120), distance=1.6)
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    truth = draw(body, standing(body, 1.15), rig, masks=True, disc=FLESH)
    drawn = draw(body, standing(body, 1.15), rig, disc=FLESH)
    empty = {k: scene((160, 120), seed=k, contrast=10.0) for k in cameras}
    pictures = {k: photo(np.where(truth[k][..., None], drawn[k], empty[k]), k) for k in cameras}
    row, column = corner
    pictures[0][row : row + 12, column : column + 16] = (20, 20, 250)
    unknown = {0: cv2.dilate(truth[0].astype(np.uint8), np.ones((13, 13))) > 0}
    plates = {k: photo(picture, 50 + k) for k, picture in empty.items()}
    found = masks_from_backgrounds(pictures, plates, {}, cameras, UP, unknown, decide=False).masks
    assert not (found.get(0, np.zeros((120, 160), bool)) & unknown[0]).any()
    for k in (1, 2, 3):
        assert iou(found[k], truth[k]) > 0.8
