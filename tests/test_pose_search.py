"""The search for the first pose: places, limbs, and pictures of bodies whose pose is known."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, shipped
from drawn_scene import draw, in_colors, moved, standing
from rig_cases import ring_rig

from sogjax.energy.frame_energy import standard_terms
from sogjax.images.cells import CellGrid, stack_cells
from sogjax.images.quadtree import Candidates
from sogjax.tracking.culling import ImageReader
from sogjax.tracking.frame_views import FrameViews, levels
from sogjax.tracking.limbs import limbs, with_other_limb
from sogjax.tracking.place_search import nearest_point, possible_places, well_seen
from sogjax.tracking.pose_search import search_pose, search_poses, strain

RIG = ring_rig(4, (320, 240), distance=2.5)
TERMS = standard_terms()


def frame_of(images, rig=RIG, depth=8):
    grids = [tuple(CellGrid.from_depth(*rig.image_size(name), level) for name in rig.names) for level in levels(depth)]
    reader = lambda grid: ImageReader(
        candidates=Candidates.from_grids(grid, rig.cameras),
        color_radius=0.3,
        color_tolerance=0.1,
        box_enlargement=0.15,
        color_space="hsv_cylinder",
    )
    cells = tuple(jnp.asarray(stack_cells(images, grid)) for grid in grids)
    return FrameViews(rig.cameras, tuple(reader(grid) for grid in grids), cells)


def over(images, others):
    """One picture painted over another where it is not background."""
    return [np.where((b == 70).all(-1, keepdims=True), a, b) for a, b in zip(images, others, strict=True)]


def off(body, found, truth):
    """Mean distance of the landmarks (metres)."""
    at = lambda pose: np.asarray(posed(body, jnp.asarray(pose, jnp.float32))[1], float)
    return np.linalg.norm(at(found) - at(truth), axis=1).mean()


@pytest.fixture(scope="module")
def dog():
    return in_colors(shipped("dog"))


@pytest.mark.slow
def test_a_dog_is_found_without_a_hint(dog):
    truth = moved(dog, standing(dog, 1.1, (0.3, -0.2)), {"root_yaw": 2.1})
    found = search_pose(dog, frame_of(draw(dog, truth, RIG)), TERMS, "z")
    assert off(dog, found.pose, truth) < 0.05
    assert found.energy > 0.0
    assert 0.0 < found.margin <= 1.0


@pytest.mark.slow
def test_two_dogs_of_other_colours_are_both_found(dog):
    other = replace(in_colors(shipped("dog"), (175.0, 90.0)), name="other")
    first = moved(dog, standing(dog, 1.1, (0.0, 0.45)), {"root_yaw": 0.4})
    second = moved(dog, standing(dog, 1.1, (0.1, -0.45)), {"root_yaw": -2.6})
    frame = frame_of(over(draw(dog, first, RIG), draw(other, second, RIG)))
    found = search_poses([dog, other], frame, TERMS, "z")
    assert off(dog, found[0].pose, first) < 0.06
    assert off(other, found[1].pose, second) < 0.06


def test_places_are_in_sight_and_around_what_the_cameras_look_at():
    cameras = jax.tree.map(jnp.asarray, RIG.cameras)
    places = possible_places(cameras, "z")
    assert np.all(np.asarray(well_seen(cameras, jnp.asarray(places, jnp.float32))))
    # The ring looks at (0, 0, 1.2).
    assert np.linalg.norm(places - np.array([0.0, 0.0, 1.2]), axis=1).min() < 0.25
    assert np.linalg.norm(places.mean(axis=0)[:2]) < 0.15


def test_lines_through_one_point_meet_there():
    point = np.array([0.3, -0.2, 1.0])
    directions = np.array([[1.0, 0.2, 0.1], [0.0, 1.0, 0.3], [0.5, -0.4, 1.0]])
    np.testing.assert_allclose(nearest_point(point - 2.0 * directions, directions), point, atol=1e-9)


def test_limbs_of_a_human_are_head_arms_and_legs():
    human = shipped("human")
    names = [{human.skeleton.dof_names[dof] for dof in limb} for limb in limbs(human.skeleton)]
    assert len(names) == 5
    assert any("left_elbow" in limb and "left_wrist_bend" in limb and "right_elbow" not in limb for limb in names)
    assert any("right_knee" in limb and "right_hip_bend" in limb for limb in names)
    assert any("head_bend" in limb and "neck_twist" in limb for limb in names)
    assert not any("spine_bend" in limb or "root_x" in limb for limb in names)


def test_variants_differ_in_one_limb_only_and_are_all_different():
    human = shipped("human")
    pose = human.poses["squat"]
    limb = limbs(human.skeleton)[1]
    variants = np.asarray(with_other_limb(human, pose, limb, jnp.stack([human.poses["sit"], pose])))
    rest = np.setdiff1d(np.arange(pose.shape[0]), limb)
    np.testing.assert_array_equal(variants[:, rest], np.tile(np.asarray(pose)[rest], (len(variants), 1)))
    np.testing.assert_array_equal(variants[0], pose)
    apart = np.abs(variants[:, None, limb] - variants[None, :, limb]).max(-1)
    assert np.all(apart[~np.eye(len(variants), dtype=bool)] > 1e-3)


def test_strain_counts_joints_near_the_end_of_their_range():
    human = shipped("human")
    at = lambda **values: float(strain(human.skeleton, jnp.asarray(moved(human, human.poses["rest"], values))))
    assert at() == 0.0
    assert at(root_x=50.0, root_yaw=9.0, left_elbow=0.0, left_hip_bend=1.2) == 0.0
    np.testing.assert_allclose(at(left_hip_twist=-0.9, right_hip_twist=0.9), 2.0, atol=1e-5)
    np.testing.assert_allclose(at(spine_twist=0.85), 0.25, atol=1e-5)
    np.testing.assert_allclose(at(spine_twist=5.0), 1.0, atol=1e-5)
    assert at(left_elbow=-0.1) == 0.0  # its range ends a little behind straight, which is no strain
