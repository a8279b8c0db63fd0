"""Triangulation: points back from OpenCV's projections, wrong cameras left out, people told apart."""

import numpy as np
import pytest
from keypoint_cases import STANDING
from rig_cases import opencv_pixels, ring_rig

from sogjax.io.keypoints.load import Keypoints
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.search.keypoint_people import triangulated_people
from sogjax.search.triangulation import Rays, interpolated, poses_of, rays_of, triangulated

EXACT = 1e-3
"""Metres; pixels pass through float32 when they are undistorted."""
POINTS = np.random.default_rng(0).uniform(-0.6, 0.6, (40, 3)) + np.array([0.0, 0.0, 1.2])


def seen_by(rig, points=POINTS):
    pixels = np.stack([opencv_pixels(rig, name, points) for name in rig.names])
    return Rays(poses_of(rig), rays_of(rig, pixels), np.ones(pixels.shape[:2]))


@pytest.mark.parametrize("cameras", [2, 3, 6])
def test_points_come_back_from_their_pixels(cameras):
    found = triangulated(seen_by(ring_rig(cameras)))
    np.testing.assert_allclose(found.points, POINTS, atol=EXACT)
    assert (found.num_cameras == cameras).all()
    assert found.errors.max() < EXACT


def test_a_camera_that_is_wrong_about_a_point_is_left_out():
    seen = seen_by(ring_rig(5))
    wrong = np.arange(len(POINTS)) % 5
    seen.rays[wrong, np.arange(len(POINTS))] += 0.2
    found = triangulated(seen)
    np.testing.assert_allclose(found.points, POINTS, atol=EXACT)
    assert (found.num_cameras == 4).all()


def test_a_camera_counts_as_much_as_it_is_sure():
    rig = ring_rig(4)
    exact, moved = seen_by(rig), seen_by(rig, POINTS + np.array([0.0, 0.0, 0.02]))
    rays = np.where(np.arange(4)[:, None, None] < 2, exact.rays, moved.rays)
    weights = np.where(np.arange(4)[:, None] < 2, 1.0, 0.05) * np.ones_like(exact.weights)
    np.testing.assert_allclose(triangulated(Rays(exact.poses, rays, weights)).points, POINTS, atol=2 * EXACT)


def test_what_fewer_than_two_cameras_see_is_no_point():
    seen = seen_by(ring_rig(3))
    seen.weights[1:, 0] = 0.0
    seen.weights[:, 1] = 0.0
    found = triangulated(seen)
    assert np.isnan(found.points[:2]).all()
    assert (found.num_cameras[:3] == [0, 0, 3]).all()
    np.testing.assert_allclose(found.points[2:], POINTS[2:], atol=EXACT)
    one = triangulated(seen_by(ring_rig(1)))
    assert np.isnan(one.points).all()


def test_cameras_that_do_not_agree_give_no_point():
    seen = seen_by(ring_rig(3))
    seen.weights[2] = 0.0
    seen.rays[1] += [0.0, 0.2]
    assert np.isnan(triangulated(seen).points).all()


def walking(scheme, frames, start, step):
    """A person of 1.7 m who stands on z = 0.3 and moves: (frame, keypoint, 3)."""
    points = []
    for landmark in scheme.landmarks:
        side = {"left": 1.0, "right": -1.0}.get(landmark.split("_")[0], 0.0)
        across, up = STANDING[landmark.removeprefix("left_").removeprefix("right_")]
        points.append((0.0, 1.7 * side * across, 0.3 + 1.7 * up))
    return np.array(points)[None] + start + np.arange(frames)[:, None, None] * np.array(step)


def test_people_are_told_apart_across_cameras_and_followed():
    rig, scheme = ring_rig(4, distortion=(0.0,) * 5), named_scheme("BODY_25")
    people = [
        walking(scheme, 6, (-0.5, 0.0, 0.0), (0.2, 0.0, 0.0)),
        walking(scheme, 6, (0.5, 0.3, 0.0), (-0.2, 0.0, 0.0)),
    ]
    stacked = np.stack(people, axis=1)
    rng = np.random.default_rng(3)
    points = np.zeros((4, 6, 3, 25, 3), np.float32)
    for camera, name in enumerate(rig.names):
        for frame in range(6):
            order = rng.permutation(3)
            pixels = opencv_pixels(rig, name, stacked[frame])
            points[camera, frame, order[:2], :, :2] = pixels
            points[camera, frame, order[:2], :, 2] = 0.9
            # somebody who is nobody
            points[camera, frame, order[2]] = np.column_stack([rng.uniform(0, 240, (25, 2)), np.full(25, 0.6)])
    found = triangulated_people(Keypoints(scheme, rig.names, points), rig, 2)
    first = int(np.linalg.norm(found.points[0] - people[0][0][None], axis=-1).mean(-1).argmin())
    np.testing.assert_allclose(found.points[:, first], people[0], atol=EXACT)
    np.testing.assert_allclose(found.points[:, 1 - first], people[1], atol=EXACT)


def test_nobody_is_found_where_nobody_is():
    rig, scheme = ring_rig(3), named_scheme("COCO_17")
    found = triangulated_people(Keypoints(scheme, rig.names, np.zeros((3, 2, 1, 17, 3), np.float32)), rig)
    assert np.isnan(found.points).all()
    assert found.points.shape == (2, 1, 17, 3)


def test_short_gaps_are_filled_on_a_line():
    points = np.full((7, 1, 3), np.nan)
    points[1], points[3], points[6] = 1.0, 3.0, 9.0
    filled = interpolated(points, 1)
    np.testing.assert_array_equal(filled[:, 0, 0], [np.nan, 1.0, 2.0, 3.0, np.nan, np.nan, 9.0])
    np.testing.assert_array_equal(interpolated(points, 2)[:, 0, 0], [np.nan, 1.0, 2.0, 3.0, 5.0, 7.0, 9.0])
