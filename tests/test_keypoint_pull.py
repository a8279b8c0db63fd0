"""Keypoints that detectors saw, as a term of the energy: value, derivatives, whose keypoint is whose, and outliers."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body
from rig_cases import ring_rig
from sog_cases import in_float64

from sogjax.energy.keypoint_views import LEAST, KeypointViews, SeenKeypoints, belonging, body_sizes
from sogjax.energy.keypoints import KeypointTerm
from sogjax.energy.posed import Posed
from sogjax.model.camera import project_points

COUNT, PEOPLE = 3, 2
MIRRORED, GROUPS = (1, 0, 2), (0, 0, -1)


@pytest.fixture(autouse=True)
def double():
    with jax.enable_x64(True):
        yield


@pytest.fixture
def cameras(double):
    return in_float64(jax.tree.map(jnp.asarray, ring_rig(2).cameras))


@pytest.fixture
def body(double):
    one = random_body(4)
    whole = replace(one.skeleton, parents=(-1, *(max(parent, 0) for parent in one.skeleton.parents[1:])))
    return in_float64(replace(one, skeleton=whole))


def pull(**values):
    marks = values.pop("landmarks", ((0, 1, 2),))
    offsets = values.pop("offsets", jnp.zeros((len(marks), COUNT, 3)))
    return in_float64(KeypointTerm(1.0, landmarks=marks, mirrored=MIRRORED, groups=GROUPS, offsets=offsets, **values))


@eqx.filter_jit
def projected(cameras, body, pose):
    """Landmarks in every picture: (camera, keypoint, 2)."""
    points = body.posed_landmarks(pose)
    return jax.vmap(project_points, in_axes=(0, None))(cameras, points)[0]


@eqx.filter_jit
def sizes(cameras, body, pose):
    """Of the body in every picture."""
    return body_sizes(cameras, body.posed_blobs(pose), jnp.full(2, 1e4), np.zeros(body.num_blobs, int))


def views_of(cameras, body, pose, pixels, sure, exchanged=0.0):
    """Of keypoints (camera, person, keypoint, 2)."""
    seen = SeenKeypoints(jnp.asarray(pixels, jnp.float64), jnp.asarray(sure, jnp.float64))
    scale, areas = sizes(cameras, body, pose)
    belongs = jnp.ones((*seen.confidence.shape[:2], scale.shape[1]))
    return KeypointViews(seen, jnp.full(seen.confidence.shape, exchanged), scale, areas, belongs)


@eqx.filter_jit
def model(term, body, cameras, views, pose):
    return term.model(Posed.from_pose(body, pose), cameras, views)


def value(term, body, cameras, views, pose):
    return model(term, body, cameras, views, pose).value


@eqx.filter_jit
def slope(term, body, cameras, views, pose):
    """The derivative of the value, by autodiff."""
    return jax.grad(lambda p: term.model(Posed.from_pose(body, p), cameras, views).value)(pose)


def drawn(seed=0, people=PEOPLE):
    """Landmarks in every picture with something added, for so many people."""
    return np.random.default_rng(seed).normal(scale=6.0, size=(2, people, COUNT, 2))


def near(body):
    return body.poses["rest"]


@pytest.mark.slow
@pytest.mark.parametrize("tolerance", [0.0, 0.02])
def test_the_gradient_is_that_of_autodiff(body, cameras, tolerance):
    pose = near(body)
    pixels = np.asarray(projected(cameras, body, pose))[:, None] + drawn()
    sure = np.random.default_rng(1).uniform(0.2, 1.0, (2, PEOPLE, COUNT))
    views = views_of(cameras, body, pose, pixels, sure, exchanged=0.3)
    term = pull(tolerance=tolerance, offsets=jnp.full((1, COUNT, 3), 0.01))
    expected = slope(term, body, cameras, views, pose + 0.01)
    found = model(term, body, cameras, views, pose + 0.01)
    assert float(jnp.linalg.norm(expected)) > 1e-6
    np.testing.assert_allclose(found.gradient, expected, rtol=1e-9, atol=1e-14)
    assert float(jnp.linalg.eigvalsh(found.curvature).min()) > -1e-12


@pytest.mark.slow
def test_the_curvature_is_that_of_the_value_where_the_landmarks_lie_on_keypoints(body, cameras):
    """Gauss-Newton is exact there, but for the constant that takes its share."""
    pose = near(body)
    pixels = np.asarray(projected(cameras, body, pose))[:, None]
    views = views_of(cameras, body, pose, pixels, np.ones((2, 1, COUNT)))
    term = pull(outlier=0.1)
    expected = -jax.hessian(lambda p: value(term, body, cameras, views, p))(pose)
    found = model(term, body, cameras, views, pose)
    np.testing.assert_allclose(found.curvature, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(found.value, np.log(1.0 + 1.0 / 0.1) * np.mean(views.areas), rtol=1e-6)


def test_somebody_else_far_away_does_not_matter(body, cameras):
    pose = near(body)
    pixels = np.asarray(projected(cameras, body, pose))[:, None] + drawn(people=1)
    alone = views_of(cameras, body, pose, pixels, np.ones((2, 1, COUNT)))
    both = views_of(cameras, body, pose, np.concatenate([pixels + 900.0, pixels], axis=1), np.ones((2, 2, COUNT)))
    one, two = (model(pull(), body, cameras, views, pose) for views in (alone, both))
    np.testing.assert_allclose(two.value, one.value, rtol=1e-9)
    np.testing.assert_allclose(two.gradient, one.gradient, rtol=1e-9)


def test_padding_is_inert_whatever_it_holds(body, cameras):
    pose = near(body)
    at = np.asarray(projected(cameras, body, pose))[:, None]
    views = views_of(cameras, body, pose, np.concatenate([at, at], axis=1), np.zeros((2, 2, COUNT)))
    assert (np.asarray(slope(pull(), body, cameras, views, pose)) == 0.0).all()
    assert float(value(pull(), body, cameras, views, pose)) == 0.0


def seen_by(cameras, body, pose, which):
    """The keypoints of a detector that exchanged the sides in some of the cameras, as the term takes them."""
    cameras = jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), cameras)
    at = np.asarray(projected(cameras, body, pose))[:, None]
    at = np.stack([one[:, list(MIRRORED)] if k in which else one for k, one in enumerate(at)])
    seen = SeenKeypoints(jnp.asarray(at), jnp.full((4, 1, COUNT), 0.8))
    return pull().views(seen, cameras, Posed.from_pose(body, pose + 0.01), jnp.full(4, 1e4))


@pytest.mark.slow
def test_exchanged_sides_are_noticed_and_counted_as_what_they_are(body, cameras):
    """Of one camera; where all agree with each other, it is the body whose sides are exchanged."""
    pose = near(body)
    right, wrong, all_wrong = (seen_by(cameras, body, pose, which) for which in ((), (2,), (0, 1, 2, 3)))
    assert float(right.exchanged.max()) < 0.1
    assert float(wrong.exchanged[2, 0, :2].min()) > 0.9
    assert float(np.asarray(wrong.exchanged)[[0, 1, 3]].max()) < 0.1
    assert (np.asarray(wrong.exchanged[:, :, 2]) == 0.0).all()  # it has no other side
    assert float(all_wrong.exchanged.max()) == 0.0


def test_exchanged_keypoints_count_as_those_of_the_other_side(body, cameras):
    pose = near(body)
    at = np.asarray(projected(cameras, body, pose))[:, None]
    right = views_of(cameras, body, pose, at, np.ones((2, 1, COUNT)))
    wrong = views_of(cameras, body, pose, at[:, :, list(MIRRORED)], np.ones((2, 1, COUNT)), exchanged=1.0)
    np.testing.assert_allclose(*(value(pull(), body, cameras, views, pose) for views in (right, wrong)), rtol=1e-9)


def test_a_keypoint_without_landmark_or_behind_the_camera_says_nothing(body, cameras):
    pose = near(body)
    at = np.asarray(projected(cameras, body, pose))[:, None]
    views = views_of(cameras, body, pose, at, np.ones((2, 1, COUNT)))
    assert float(value(pull(landmarks=((-1, -1, -1),)), body, cameras, views, pose)) == 0.0
    flip = jnp.asarray(np.diag([1.0, -1.0, -1.0, 1.0]))
    behind = eqx.tree_at(lambda c: c.camera_from_world, cameras, flip[None] @ cameras.camera_from_world)
    assert float(value(pull(), body, behind, views, pose)) == 0.0


def test_two_actors_are_each_drawn_to_what_is_near(body, cameras):
    """Their landmarks are those of one body, by actor."""
    pose = near(body)
    at = np.asarray(projected(cameras, body, pose))[:, None]
    seen = SeenKeypoints(jnp.asarray(at), jnp.ones((2, 1, COUNT)))
    views, one = (
        KeypointViews(seen, jnp.zeros((2, 1, COUNT)), jnp.full((2, n), 300.0), jnp.ones(2), jnp.ones((2, 1, n)))
        for n in (2, 1)
    )
    twice = pull(landmarks=((0, 1, 2), (0, 1, 2)), offsets=jnp.zeros((2, COUNT, 3)))
    both, alone = model(twice, body, cameras, views, pose + 0.01), model(pull(), body, cameras, one, pose + 0.01)
    np.testing.assert_allclose(both.gradient, alone.gradient, rtol=1e-9)


belonging_of = jax.jit(belonging)


def belongs(people, actors, sure=None):
    """Of people in one picture of 100 pixels a metre, whose keypoints lie where (metres), and actors there."""
    spread = np.arange(COUNT)[:, None] * [0.0, 0.5]
    pixels = 100.0 * (np.asarray(people, float)[None, :, None] + spread)
    seen = SeenKeypoints(jnp.asarray(pixels), jnp.ones(pixels.shape[:3]) if sure is None else jnp.asarray(sure)[None])
    at = 100.0 * (np.asarray(actors, float)[None, :, None] + spread)
    found = belonging_of(seen, jnp.asarray(at), jnp.ones(at.shape[:3], bool), jnp.full((1, len(actors)), 100.0))
    return np.asarray(found)[0]


def test_each_of_two_people_is_the_actor_who_is_nearer():
    found = belongs([(0.0, 0.0), (0.4, 0.0)], [(0.45, 0.0), (0.05, 0.0)])
    np.testing.assert_allclose(found, [[LEAST, 1.0], [1.0, LEAST]], atol=0.01)


def test_somebody_else_is_not_the_only_actor():
    np.testing.assert_allclose(belongs([(0.0, 0.0), (0.6, 0.0)], [(0.1, 0.0)])[:, 0], [1.0, LEAST], atol=0.01)


def test_where_nobody_is_near_all_count_alike():
    np.testing.assert_allclose(belongs([(3.0, 0.0), (5.0, 0.0)], [(0.0, 0.0)]), 1.0)


def test_nobody_is_two_actors():
    found = belongs([(0.0, 0.0), (0.6, 0.0)], [(0.05, 0.0), (0.3, 0.0)])  # the second actor is as near to both
    assert found[0, 0] == found[1, 1] == 1.0
    assert found[0, 1] < 0.2


def test_a_person_without_keypoints_is_nobody_in_particular():
    found = belongs([(0.0, 0.0), (9.0, 9.0)], [(0.0, 0.0)], sure=np.array([[1.0] * COUNT, [0.0] * COUNT]))
    assert found[0, 0] == 1.0
    assert np.isfinite(found).all()


def test_one_person_is_the_nearer_of_two_actors():
    np.testing.assert_allclose(belongs([(0.0, 0.0)], [(0.05, 0.0), (0.4, 0.0)]), [[1.0, LEAST]], atol=0.02)


@pytest.mark.parametrize("actors", [[(0.05, 0.0), (0.7, 0.0)], [(2.0, 0.0), (3.0, 0.0)]], ids=["near", "far"])
def test_room_for_people_whom_nobody_fills_changes_nothing(actors):
    padded = belongs([(0.0, 0.0), (9.0, 9.0)], actors, sure=np.array([[1.0] * COUNT, [0.0] * COUNT]))
    np.testing.assert_array_equal(padded[:1], belongs([(0.0, 0.0)], actors))


def test_an_actor_is_drawn_to_the_people_who_belong_to_it(body, cameras):
    """Two actors and two people: what each says is what it says alone, to whom it belongs."""
    pose = near(body)
    at = np.asarray(projected(cameras, body, pose))[:, None] + drawn(people=2)
    zeros, ones = jnp.zeros((2, 2, COUNT)), jnp.ones((2, 2, COUNT))
    views = lambda belongs: KeypointViews(
        SeenKeypoints(jnp.asarray(at), ones), zeros, jnp.full((2, 2), 300.0), jnp.ones(2), jnp.asarray([belongs] * 2)
    )
    twice = pull(landmarks=((0, 1, 2), (0, 1, 2)), offsets=jnp.zeros((2, COUNT, 3)))
    pulls = eqx.filter_jit(lambda views: twice.pulls(twice.points(Posed.from_pose(body, pose)), cameras, views))
    found = pulls(views([[1.0, 0.0], [0.0, 1.0]])).by_point
    for actor, part in enumerate((slice(0, COUNT), slice(COUNT, 2 * COUNT))):
        only = np.zeros((2, 2))
        only[actor] = 1.0  # the other one is nobody's
        alone = pulls(views(only)).by_point
        np.testing.assert_allclose(found[part], alone[part], rtol=1e-9)
    assert not np.allclose(found[:COUNT], found[COUNT:])
