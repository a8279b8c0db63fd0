"""The rendered person: a closed surface of human size whose skin follows the bones."""

from collections import Counter
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sogjax.synth.anatomy import INDEX, JOINTS, PARENTS, Pose, anatomy_from_seed
from sogjax.synth.clothes import Wardrobe, outfits_from_seed
from sogjax.synth.figure import make_figure
from sogjax.synth.flesh import bind_pose
from sogjax.synth.landmarks import LANDMARKS, MARKERS, landmark_points, marker_vertices
from sogjax.synth.limbs import pose_from_angles, reach
from sogjax.synth.rotations import partial_twist
from sogjax.synth.surface import surface_nets


@cache
def figure(seed=0):
    rng = np.random.default_rng(seed)
    return make_figure(anatomy_from_seed(rng), outfits_from_seed(rng, 1)[0])


def volume(vertices, faces):
    """By the divergence theorem."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return float(np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0)


def directed_edges(faces):
    return Counter(map(tuple, np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).tolist()))


def random_pose(seed, spread=0.4):
    rng = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(spread * rng.standard_normal((len(JOINTS), 3))).as_matrix()
    return Pose(rng.standard_normal(3), turns)


def test_surface_nets_of_a_sphere():
    vertices, faces = surface_nets(lambda p: np.linalg.norm(p, axis=1) - 0.4, np.full(3, -0.55), np.full(3, 0.55), 0.04)
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), 0.4, atol=1e-4)
    assert volume(vertices, faces) == pytest.approx(4 / 3 * np.pi * 0.4**3, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_the_surface_is_closed_and_encloses_a_person(seed):
    person = figure(seed)
    edges = directed_edges(person.faces)
    assert edges == Counter({(b, a): count for (a, b), count in edges.items()})
    assert 3000 <= len(person.faces) <= 10_000
    litres = 1000 * volume(person.rest, person.faces)
    assert 22.0 < litres / person.anatomy.stature**2 < 30.0  # 1 litre weighs 1 kg: a body-mass index, clothed
    assert person.rest[:, 2].min() == pytest.approx(0.0, abs=0.01)


def test_statures_lie_between_the_limits_and_differ():
    statures = [anatomy_from_seed(np.random.default_rng(seed)).stature for seed in range(20)]
    assert 1.60 <= min(statures) < 1.70
    assert 1.80 < max(statures) <= 1.90


def test_standing_upright_the_top_of_the_head_is_at_the_stature():
    person = figure()
    anatomy = person.anatomy
    posed = person.posed(pose_from_angles({}, np.array([0.0, 0.0, anatomy.hip_height])))
    assert posed.vertices[:, 2].max() == pytest.approx(anatomy.stature, abs=0.05)
    assert posed.vertices[:, 2].min() == pytest.approx(0.0, abs=0.015)


def test_in_the_bind_pose_the_skin_is_the_surface_as_modelled():
    person = figure()
    posed = person.posed(bind_pose(person.anatomy))
    np.testing.assert_allclose(posed.vertices, person.rest, atol=1e-9)
    np.testing.assert_allclose(person.weights.sum(1), 1.0, atol=1e-9)


def test_moving_the_whole_body_moves_every_vertex_alike():
    person, pose = figure(), random_pose(3)
    turn, shift = Rotation.from_rotvec([0.3, -1.0, 2.0]).as_matrix(), np.array([1.0, -2.0, 0.5])
    rotations = pose.rotations.copy()
    rotations[0] = turn @ rotations[0]
    moved = person.posed(Pose(turn @ pose.position + shift, rotations))
    before = person.posed(pose)
    np.testing.assert_allclose(moved.vertices, before.vertices @ turn.T + shift, atol=1e-9)
    np.testing.assert_allclose(moved.normals, before.normals @ turn.T, atol=1e-9)


def test_normals_point_outwards():
    person = figure()
    a, b, c = (person.rest[person.faces[:, k]] for k in range(3))
    across = np.cross(b - a, c - a)
    along = np.einsum("fi,fi->f", across, person.rest_normals[person.faces].mean(1))
    assert np.mean(along > 0) > 0.995


@pytest.mark.parametrize("seed", [0, 5])
def test_bones_keep_their_length(seed):
    anatomy = figure().anatomy
    frames = anatomy.world_from_joint(random_pose(seed, 1.0))
    for joint, parent in enumerate(PARENTS):
        if parent >= 0:
            length = np.linalg.norm(frames[joint, :3, 3] - frames[parent, :3, 3])
            assert length == pytest.approx(np.linalg.norm(anatomy.offsets[joint]), abs=1e-12)


@pytest.mark.parametrize("limb", [("hip", "knee", "ankle"), ("shoulder", "elbow", "wrist")])
def test_a_limb_reaches_what_is_near_enough(limb):
    anatomy, pose = figure().anatomy, random_pose(2, 0.2)
    joints = tuple(f"right_{name}" for name in limb)
    root = anatomy.world_from_joint(pose)[INDEX[joints[0]], :3, 3]
    target = root + np.array([0.25, -0.1, -0.3])
    frames = anatomy.world_from_joint(reach(anatomy, pose, joints, target, np.array([1.0, 0.2, 0.0])))
    np.testing.assert_allclose(frames[INDEX[joints[2]], :3, 3], target, atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(frames[:, :3, :3]), 1.0, atol=1e-9)


def test_partial_twist_keeps_the_swing():
    rotation = Rotation.from_rotvec([0.7, -0.4, 1.1]).as_matrix()
    np.testing.assert_allclose(partial_twist(rotation, 1.0), rotation, atol=1e-12)
    np.testing.assert_allclose(partial_twist(rotation, 0.0)[:, 2], rotation[:, 2], atol=1e-12)
    # A pure swing turns about an axis across z.
    swing = Rotation.from_matrix(partial_twist(rotation, 0.0)).as_rotvec()
    assert swing[2] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
def test_markers_are_vertices_spread_over_the_body(seed):
    person = figure(seed)
    vertices = marker_vertices(person)
    assert len(set(vertices.tolist())) == len(MARKERS) == 38
    points = person.rest[vertices]
    gaps = np.linalg.norm(points[:, None] - points[None], axis=-1) + np.eye(len(points))
    assert gaps.min() > 0.03
    names = list(MARKERS)
    for name in names:
        if name.startswith("left_"):
            left, right = points[names.index(name)], points[names.index("right_" + name[5:])]
            np.testing.assert_allclose(left * [1, -1, 1], right, atol=0.03)


def test_landmarks_lie_inside_the_person_where_they_are_said_to_be():
    anatomy = figure().anatomy
    points = dict(zip(LANDMARKS, landmark_points(anatomy, bind_pose(anatomy)), strict=True))
    hips = 0.5 * (points["left_hip"] + points["right_hip"])
    np.testing.assert_allclose(points["pelvis"], hips, atol=1e-9)
    assert points["head_top"][2] == pytest.approx(anatomy.stature, abs=0.01)
    assert points["left_toe"][0] > points["left_ankle"][0] + 0.1
    assert points["left_shoulder"][1] > 0.1 > -0.1 > points["right_shoulder"][1]
    for side in ("left", "right"):
        reach_out = np.linalg.norm(points[f"{side}_hand"] - points[f"{side}_wrist"])
        assert reach_out == pytest.approx(0.08, abs=0.01)


def test_people_of_one_recording_wear_different_clothes():
    outfits = outfits_from_seed(np.random.default_rng(5), 4)
    for piece in ("shirt", "trousers", "shoes", "hair"):
        assert len({getattr(outfit, piece) for outfit in outfits}) == 4


def test_clothes_have_several_plausible_colors():
    person = figure()
    wardrobe = Wardrobe.fitted(person.outfit, person.anatomy)
    centres = person.rest[person.faces].mean(1)
    colors = wardrobe.colors(person.face_part, centres)
    assert colors.min() >= 0.0
    assert colors.max() <= 1.0
    assert len(np.unique(colors.round(2), axis=0)) >= 6
