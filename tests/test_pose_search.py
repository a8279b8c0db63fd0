"""The search for the initial pose: places, limbs, and pictures of bodies whose pose is known."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, shipped
from drawn_scene import draw, in_colors, moved, standing
from rig_cases import ring_rig

from sogjax.energy.frame_energy import standard_terms
from sogjax.model.limbs import limbs, with_other_limb
from sogjax.scene.cells import CellGrid, stack_cells
from sogjax.scene.quadtree import Candidates
from sogjax.scene.visual_hull import nearest_point
from sogjax.search import pose_search
from sogjax.search.combination import Optima, best_combination
from sogjax.search.found_pose import TRUNK, FoundPose
from sogjax.search.joint_search import search_poses
from sogjax.search.mirrored import look_alikes, other_side, sides_apart
from sogjax.search.placed_body import centres_of, turns_with_vertical
from sogjax.search.pose_confidence import SURE, Agreement, PoseEvidence, agreed_confidence, pose_confidence
from sogjax.search.pose_search import (
    Hypotheses,
    PlacedSearch,
    PoseSearch,
    compile_pose_search,
    search,
    with_better_limbs,
)
from sogjax.search.search_energy import SearchEnergy
from sogjax.search.seen_frame import SeenFrame
from sogjax.tracking.culling import ImageReader

RIG = ring_rig(4, (320, 240), distance=2.5)
TERMS = standard_terms()


def frames_of(images, rig=RIG, depth=8):
    """What makes the frame of these images as a body is compared with it."""
    grids = tuple(CellGrid.from_depth(*rig.image_size(name), depth) for name in rig.names)
    reader = ImageReader(
        candidates=Candidates.from_grids(grids, rig.cameras),
        color_radius=0.3,
        color_tolerance=0.1,
        color_space="hsv_cylinder",
    )
    cells = stack_cells(images, grids)
    return lambda searcher, _: SeenFrame.from_cells(
        jax.tree.map(jnp.asarray, rig.cameras), reader, cells, searcher.clusters
    )


def searcher(body):
    return PoseSearch.of_body(body, TERMS, "z")


def over(images, others):
    """One picture painted over another where it is not background."""
    return [np.where((b == 70).all(-1, keepdims=True), a, b) for a, b in zip(images, others, strict=True)]


def off(body, found, truth):
    """Mean distance of the landmarks (metres)."""
    at = lambda pose: np.asarray(posed(body, jnp.asarray(pose, jnp.float32))[1], float)
    return np.linalg.norm(at(found) - at(truth), axis=1).mean()


@pytest.mark.slow
def test_what_is_compiled_beforehand_is_what_a_search_of_an_actor_in_its_colors_needs(dog, monkeypatch):
    traced, of_windows = [], SearchEnergy.of_windows
    monkeypatch.setattr(
        SearchEnergy, "of_windows", lambda energy, windows: traced.append(1) or of_windows(energy, windows)
    )
    rig = ring_rig(8, (160, 120), distance=2.5)
    seen = frames_of(draw(dog, standing(dog, 1.1, (0.3, -0.2)), rig), rig)
    template, actor = searcher(shipped("dog")), searcher(replace(dog, name="rex"))
    jax.clear_caches()
    compile_pose_search(template, seen(template, 0))
    beforehand = len(traced)
    assert search(actor, seen(actor, 0))
    assert 0 < beforehand == len(traced)


@pytest.mark.slow
def test_a_glance_is_what_six_of_eight_cameras_alone_would_say(dog):
    rig = ring_rig(8, (160, 120), distance=2.5)
    truth = standing(dog, 1.1, (0.3, -0.2))
    placed = PlacedSearch.of_places(
        (search := searcher(dog)), frames_of(draw(dog, truth, rig), rig)(search, 0), centres_of(dog, truth[None])
    )
    chosen = np.flatnonzero(placed.glance.energy.counted)
    assert len(chosen) == 6
    taken = lambda tree, axis: jax.tree.map(lambda leaf: jnp.take(leaf, chosen, axis), tree)
    energy = replace(placed.energy, cameras=taken(placed.energy.cameras, 0), counted=jnp.ones(6, bool))
    alone = replace(placed, energy=energy, windows=taken(placed.windows, 1))
    near = np.stack([truth, moved(dog, truth, {"root_x": 0.1, "root_yaw": 0.3})]).astype(np.float32)
    tried = Hypotheses(near, np.zeros(2, int), np.zeros(2))
    scored, climbed = placed.glance.scored(tried).values, placed.glance.climbed(tried, 3)
    np.testing.assert_allclose(scored, alone.scored(tried).values, rtol=1e-4)
    np.testing.assert_allclose(climbed.values, alone.climbed(tried, 3).values, rtol=1e-3)
    assert abs(placed.scored(tried).values - scored).max() > 1e-3
    assert (climbed.values >= scored).all()


@pytest.fixture(scope="module")
def dog():
    return in_colors(shipped("dog"))


@pytest.mark.slow
def test_a_dog_is_found_without_a_hint(dog):
    truth = moved(dog, standing(dog, 1.1, (0.3, -0.2)), {"root_yaw": 2.1})
    search = searcher(dog)
    told = []
    found = search_poses([search], frames_of(draw(dog, truth, RIG)), 1, told=told.append)[0].found
    assert off(dog, found.pose, truth) < 0.05
    (places,) = told
    assert np.linalg.norm(places[0].centre - centres_of(dog, found.pose[None])[0]) < 0.1
    assert found.energy > 0.0
    assert 0.0 < found.margin <= 1.0


@pytest.mark.slow
def test_two_dogs_of_other_colours_are_both_found(dog):
    other = replace(in_colors(shipped("dog"), (175.0, 90.0)), name="other")
    first = moved(dog, standing(dog, 1.1, (0.0, 0.45)), {"root_yaw": 0.4})
    second = moved(dog, standing(dog, 1.1, (0.1, -0.45)), {"root_yaw": -2.6})
    make = frames_of(over(draw(dog, first, RIG), draw(other, second, RIG)))
    shares = []
    found = [path.found for path in search_poses([searcher(dog), searcher(other)], make, 1, shares.append)]
    assert shares == sorted(shares)
    assert 0.0 < shares[0] < shares[-1] <= 1.0
    assert off(dog, found[0].pose, first) < 0.06
    assert off(other, found[1].pose, second) < 0.06


def test_lines_through_one_point_meet_there():
    point = np.array([0.3, -0.2, 1.0])
    directions = np.array([[1.0, 0.2, 0.1], [0.0, 1.0, 0.3], [0.5, -0.4, 1.0]])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
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
    pose = np.asarray(human.poses["squat"])
    limb = limbs(human.skeleton)[1]
    variants = np.asarray(with_other_limb(human, pose, limb, np.stack([human.poses["sit"], pose])))
    rest = np.setdiff1d(np.arange(pose.shape[0]), limb)
    np.testing.assert_array_equal(variants[:, rest], np.tile(np.asarray(pose)[rest], (len(variants), 1)))
    np.testing.assert_array_equal(variants[0], pose)
    apart = np.abs(variants[:, None, limb] - variants[None, :, limb]).max(-1)
    assert np.all(apart[~np.eye(len(variants), dtype=bool)] > 1e-3)


def test_a_body_without_limbs_is_searched_as_a_whole(monkeypatch):
    monkeypatch.setattr(pose_search, "limbs", lambda skeleton: [])
    placed = object.__new__(PlacedSearch)
    object.__setattr__(placed, "searcher", PoseSearch.of_body(shipped("dog"), (), "z"))
    tried = Hypotheses(np.zeros((2, 3), np.float32), np.zeros(2, int), np.zeros(2, np.float32))
    assert with_better_limbs(placed, tried) is tried


def test_a_pose_is_sure_only_if_every_condition_is_met():
    good = PoseEvidence(1.5, 0.03, 0.03, 0.9, 0.87, 0.85, 1.3, 0.7, known=1.0)
    assert pose_confidence(good) > SURE
    for name in ("energy", "margin", "later_margin", "foreground", "worst_foreground", "not_background", "gain"):
        assert pose_confidence(replace(good, **{name: 0.0})) < 0.99 * SURE
    # Where no background is known, less of what is seen looks like foreground.
    assert pose_confidence(replace(good, foreground=0.5)) < 0.5
    assert 0.0 <= pose_confidence(replace(good, margin=-100.0)) < 1e-9  # no overflow
    assert pose_confidence(replace(good, foreground=0.5, known=0.0)) > SURE


def test_two_searches_that_agree_are_sure_unless_there_is_a_reason_why_both_may_be_wrong():
    good = Agreement(apart=0.02, moved=0.3, sides=1.1, worst_limb=0.4)
    assert agreed_confidence(good) > SURE
    for worse in ({"apart": 0.12}, {"moved": 0.0}, {"sides": 0.6}, {"worst_limb": -0.3}):
        assert agreed_confidence(replace(good, **worse)) < 0.7
    assert (
        agreed_confidence(replace(good, apart=0.04)) > SURE > agreed_confidence(replace(good, apart=0.04, num_actors=2))
    )
    unsure = FoundPose(np.zeros(3), 1.0, 0.0, False, 0.2)
    assert unsure.with_agreements(good, {}).sure
    assert unsure.with_agreements(replace(good, apart=0.5), {}).confidence == 0.2


def test_a_limb_that_is_not_sure_leaves_the_trunk_sure():
    good = Agreement(apart=0.02, moved=0.3, sides=1.1, worst_limb=0.4)
    far = replace(good, apart=0.5)
    unsure = FoundPose(np.zeros(3), 1.0, 0.0, False, 0.2)
    found = unsure.with_agreements(far, {TRUNK: good, "left arm": far, "right arm": good})
    assert not found.sure
    assert found.trunk_sure
    assert found.unsure_limbs == ["left arm"]
    assert not unsure.trunk_sure, "a pose without parts is as sure as the whole"


def two_in_one_place():
    """Either actor fits the place of the first best; each place explains one body only."""
    inside = np.array([[True, False], [False, True]])
    given = np.array([[0.1, 2.0], [1.6, 0.1]])
    first = Optima(np.array([2.0, 1.6]), {1: given}, {1: inside})
    second = Optima(np.array([1.9, 1.8]), {0: np.array([[0.1, 1.9], [1.8, 0.1]])}, {0: inside})
    return [first, second]


def test_two_actors_take_the_places_that_explain_most_together():
    found = best_combination(two_in_one_place())
    assert found.chosen == (0, 1)
    assert found.energy == pytest.approx(2.0 + 1.8)
    assert found.apart
    assert found.shares == pytest.approx((1.0, 1.8 / 1.9))
    # Exchanged they would explain 1.6 + 1.9.
    assert found.exchange == pytest.approx(((3.8 - 3.5) / 3.8, (3.8 - 3.5) / 3.8))


def test_two_actors_are_in_one_place_only_if_there_is_no_other():
    crowded = [
        Optima(np.array([2.0]), {1: np.array([[0.1]])}, {1: np.array([[True]])}),
        Optima(np.array([1.9]), {0: np.array([[0.1]])}, {0: np.array([[True]])}),
    ]
    found = best_combination(crowded)
    assert not found.apart
    assert found.shares == pytest.approx((0.05, 0.1 / 1.9))


def test_crossed_legs_are_nearer_to_each_other_than_in_any_named_pose():
    human = shipped("human")
    pose = np.asarray(human.poses["rest"], np.float32)
    crossed = pose.copy()
    names = human.skeleton.dof_names
    for side in ("left", "right"):
        crossed[names.index(f"{side}_hip_side")] = -0.2
    apart = sides_apart(human, np.stack([pose, crossed]))
    assert apart[0] >= 0.99
    assert apart[1] < 0.8


def test_the_look_alikes_of_a_pose_have_its_silhouette_and_other_sides():
    human = shipped("human")
    pose = np.asarray(human.poses["walk_left"])
    others = look_alikes(human, pose)
    sides = other_side(human.blobs.names)
    blobs = lambda pose: np.asarray(posed(human, jnp.asarray(pose))[0].means)
    # The first is turned back to front: what was left is right, and stands where the other stood.
    assert np.linalg.norm(blobs(others[0]) - blobs(pose)[sides], axis=1).mean() < 0.05
    assert np.linalg.norm(blobs(others[0]) - blobs(pose), axis=1).mean() > 0.1


def test_turned_bodies_point_where_they_should_in_all_headings():
    human = shipped("human")
    rest = np.asarray(human.poses["rest"])
    turned = turns_with_vertical(human, [rest], np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    points = [np.asarray(posed(human, jnp.asarray(pose))[1]) for pose in turned]
    names = human.landmarks.names
    along = np.array([p[names.index("head_top")] - p[names.index("pelvis")] for p in points])
    assert np.all(along[:, 0] / np.linalg.norm(along, axis=1) > np.cos(0.45))
    assert len(turned) >= 8
