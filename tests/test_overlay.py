"""The overlay: what is drawn, and that it lies where OpenCV projects it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from motion_cases import walking_motion
from rig_cases import black, opencv_pixels, ring_rig

from sogjax.errors import InputError
from sogjax.io.recording import open_recording
from sogjax.io.video import read_frames
from sogjax.view.bones import _PALETTE, LEFT, MIDDLE, RIGHT, bones_from_motion, sides_of
from sogjax.view.overlay import Overlay, overlay_frame
from sogjax.view.projection import picture_points
from sogjax.view.tiles import grid_for, shrink

RECORDINGS = Path(__file__).parents[2] / "shared" / "recordings"


def test_points_of_the_picture_are_those_of_opencv_with_distortion():
    rig = ring_rig()
    motion = walking_motion(300, start=(-4.0, 0.0, 1.0))
    points = motion.blob_means[:60]
    pixels, depths = picture_points(rig, points)
    for k, name in enumerate(rig.names):
        expected = opencv_pixels(rig, name, points)
        seen = np.isfinite(pixels[k]).all(-1)
        assert seen.any()
        np.testing.assert_allclose(pixels[k][seen], expected[seen], atol=2e-2)
        pose = np.asarray(rig.camera(name).camera_from_world)
        np.testing.assert_allclose(depths[k], points @ pose[2, :3] + pose[2, 3], atol=1e-4)
        assert not seen[depths[k] <= 0].any()


def test_long_motions_are_projected_in_parts_without_a_seam():
    rig, motion = ring_rig(2), walking_motion(3000, still=True)
    pixels, _ = picture_points(rig, motion.blob_means)
    np.testing.assert_allclose(pixels, np.broadcast_to(pixels[:, :1], pixels.shape), atol=1e-3)


def test_bones_join_distinct_joints_and_reach_to_the_tips():
    motion = walking_motion()
    bones = bones_from_motion(motion)

    def origin(name):
        return motion.world_from_joint[:, list(motion.joint_names).index(name), :3, 3]

    expected = [
        ("root_rz", "left_shoulder_flexion", LEFT),
        ("left_shoulder_flexion", "left_elbow", LEFT),
        ("root_rz", "right_shoulder_flexion", RIGHT),
        ("right_shoulder_flexion", "right_elbow", RIGHT),
    ]
    lines = [(origin(a), origin(b), side) for a, b, side in expected]
    for elbow, blob, side in (("left_elbow", 4, LEFT), ("right_elbow", 5, RIGHT)):
        forearm = motion.blob_means[:, blob] - origin(elbow)
        length = np.linalg.norm(forearm, axis=1, keepdims=True)
        end = origin(elbow) + forearm * (length + np.sqrt(2.0 * np.log(2.0)) * motion.blob_sigma[blob]) / length
        lines.append((origin(elbow), end, side))
    assert bones.num_joints == 5
    assert len(bones.edges) == len(lines)
    for (a, b), side, (start, end, expected_side) in zip(bones.edges, bones.sides, lines, strict=True):
        np.testing.assert_allclose(bones.points(motion)[:, a], start, atol=1e-6)
        np.testing.assert_allclose(bones.points(motion)[:, b], end, atol=1e-6)
        assert side == expected_side


@pytest.mark.parametrize(
    ("name", "side"),
    [("left_knee", LEFT), ("ann/right_hip_twist", RIGHT), ("l_wrist", LEFT), ("foot.R", RIGHT),
     ("tail_3", MIDDLE), ("lumbar", MIDDLE), ("upright", MIDDLE)],
)  # fmt: skip
def test_sides_are_told_by_names(name, side):
    motion = walking_motion(1)
    motion.joint_names = np.array([name] * 9)
    assert set(sides_of(motion)) == {side}


@pytest.mark.parametrize("width", [640, 333])
def test_joints_are_drawn_where_the_small_picture_has_them(width):
    rig, motion = ring_rig(1), walking_motion()
    canvas = overlay_frame(black(rig), rig, [motion], 3, width=width)
    assert canvas.shape[1] <= width
    scale = canvas.shape[1] / 320
    shoulder = motion.world_from_joint[3, 4, :3, 3]
    x, y = np.rint((opencv_pixels(rig, "cam0", shoulder) + 0.5) * scale - 0.5).astype(int)
    assert canvas[y, x].tolist() == [255, 255, 255]
    drawn = (canvas > 0).any(axis=2)
    drawn[:20] = drawn[-24:, :90] = False  # the names
    ys, xs = np.nonzero(drawn)
    ends = opencv_pixels(rig, "cam0", np.concatenate([motion.blob_means[3], motion.world_from_joint[3, 3:, :3, 3]]))
    low, high = ends.min(axis=0) * scale, ends.max(axis=0) * scale
    assert low[0] - 5 < xs.min() < xs.max() < high[0] + 5
    assert low[1] - 5 < ys.min() < ys.max() < high[1] + 5


def test_actors_and_sides_have_colours_of_their_own():
    rig = ring_rig(1, size=(1280, 960))
    ann, bob = walking_motion(2), walking_motion(2, start=(0.0, 0.6, 1.0))

    def shows(motions, color):
        return (overlay_frame(black(rig), rig, motions, 0) == color).all(axis=2).any()

    for color in ((255, 156, 64), (64, 96, 255)):  # BGR of the first actor's left and right
        assert shows([ann], color)
    for color in ((190, 220, 40), (220, 80, 240)):
        assert shows([ann, bob], color)
        assert not shows([ann], color)


def test_cameras_can_be_chosen_and_actors_come_and_go():
    rig = ring_rig(3)
    late = walking_motion(4, first_frame=10)
    images = [np.full_like(image, 40 * (k + 1)) for k, image in enumerate(black(rig))]
    overlay = Overlay(rig, [late], cameras=["cam2", "cam0"], width=640)
    canvas = overlay.draw(images, 3)
    assert canvas.shape == (240, 640, 3)
    assert canvas[120, 160].tolist() == [120] * 3
    assert canvas[120, 480].tolist() == [40] * 3
    assert (overlay.draw(images, 12) != canvas).sum() > (overlay.draw(images, 4) != canvas).sum()
    with pytest.raises(InputError, match="cam0, cam1, cam2"):
        Overlay(rig, [late], cameras=["cam9"])


@pytest.mark.parametrize("count", range(1, 14))
@pytest.mark.parametrize("size", [(1296, 972), (1080, 1920)])
def test_grids_hold_all_pictures_and_stay_within_the_width(count, size):
    grid = grid_for([size] * count, 1920)
    assert grid.columns * grid.rows >= count > grid.columns * (grid.rows - 1)
    assert grid.size[0] <= 1920
    assert grid.size[0] % 2 == grid.size[1] % 2 == 0
    assert grid.tile_size[0] / grid.tile_size[1] == pytest.approx(size[0] / size[1], rel=0.02)
    fits = [grid.fit(k, size) for k in range(count)]
    assert max(fit.left + fit.width for fit in fits) <= grid.size[0]
    assert max(fit.top + fit.height for fit in fits) <= grid.size[1]


@pytest.mark.parametrize("count", range(1, 14))
@pytest.mark.parametrize("size", [(1296, 972), (1024, 1024), (1080, 1920)])
def test_a_grid_stays_within_a_height_as_well(count, size):
    bounded, free = grid_for([size] * count, 1920, 1080), grid_for([size] * count, 1920)
    assert bounded.size[0] <= 1920
    assert bounded.size[1] <= 1080
    assert (bounded.columns, bounded.rows) == (free.columns, free.rows)
    if free.size[1] <= 1080:
        assert bounded == free


@pytest.mark.parametrize(("count", "shape"), [(1, (1, 1)), (4, (2, 2)), (9, (3, 3)), (12, (4, 3))])
def test_a_grid_has_few_empty_places(count, shape):
    grid = grid_for([(1296, 972)] * count, 1920)
    assert (grid.columns, grid.rows) == shape


def test_a_smaller_picture_keeps_its_mean_and_its_places():
    ramp = np.tile(np.linspace(0, 255, 1200).astype(np.uint8)[None, :, None], (900, 1, 3))
    small = shrink(ramp, (340, 255))
    assert small.shape == (255, 340, 3)
    assert small.mean() == pytest.approx(ramp.mean(), abs=0.5)
    np.testing.assert_allclose(small[100, :, 0], np.linspace(0, 255, 340), atol=2.0)


@pytest.mark.skipif(not (RECORDINGS / "real_tpose").is_dir(), reason="the example recordings are not here")
def test_a_recordings_own_pictures_are_drawn_on():
    recording = open_recording(RECORDINGS / "real_tpose")
    images = next(iter(read_frames(recording, 0, 1)))
    canvas = overlay_frame(images, recording.rig, [walking_motion(1, fps=recording.fps)], 0, width=800)
    assert canvas.shape[1] <= 800
    for k in range(len(images)):
        x, y = Overlay(recording.rig, [], width=800).grid.corner(k)
        assert canvas[y + 30 : y + 150, x : x + 150].std() > 5.0


def test_a_limb_in_doubt_is_dashed():
    """Its line is broken, so that it can be told without colours."""
    rig, motion = ring_rig(1), walking_motion(2)
    left = np.array([0 if "left" in name else -1 for name in motion.joint_names])
    judged = replace(motion, limb_names=np.array(["left arm"]), joint_limb=left, limb_doubt=np.array([[0.0], [0.9]]))
    drawn = lambda motion, frame: overlay_frame(black(rig), rig, [motion], int(motion.frame[frame]))
    np.testing.assert_array_equal(drawn(judged, 0), drawn(motion, 0))
    colors = _PALETTE[0][[LEFT, RIGHT], ::-1].astype(int)
    near = lambda image, color: int((np.abs(image.astype(int) - color).max(axis=-1) < 40).sum())
    whole, dashed = ([near(drawn(one, 1), color) for color in colors] for one in (motion, judged))
    assert dashed[1] == pytest.approx(whole[1], rel=0.02)
    assert 0.2 * whole[0] < dashed[0] < 0.75 * whole[0]
