"""Motions of the rendered people: smooth, on the floor, and never through one another."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial import cKDTree
from slow_values import fast_and_slow
from synth_people import motions, people, person

from sogjax.synth.anatomy import INDEX
from sogjax.synth.gait import circle, egg
from sogjax.synth.landmarks import LANDMARKS, landmark_points

NAMES = list(LANDMARKS)
SINGLE = ["walk", "arms", "squat_kick", "cartwheel", "run", "sit", "throw", "dance", "stoop"]
FPS = 30.0
SECONDS = 3.4


@cache
def landmarks(kind):
    times = np.arange(0.0, SECONDS, 1.0 / FPS)
    return np.stack([landmark_points(person(0).anatomy, motions(kind)[0](float(t))) for t in times])


@pytest.mark.parametrize("kind", fast_and_slow(*SINGLE))
def test_nobody_jumps(kind):
    speed = np.linalg.norm(np.diff(landmarks(kind), axis=0), axis=-1) * FPS
    assert speed.max() < 13.0  # the hands and feet of a cartwheel; metres a second
    # Without a jump half of the time means about half of the way.
    twice = np.linalg.norm(landmarks(kind)[2:] - landmarks(kind)[:-2], axis=-1) * FPS
    assert speed.max() < 0.65 * twice.max()


@pytest.mark.parametrize("kind", fast_and_slow(*SINGLE))
def test_bodies_stay_on_the_floor(kind):
    body, motion = person(0), motions(kind)[0]
    lowest = [body.posed(motion(float(t))).vertices[:, 2].min() for t in np.arange(0.0, SECONDS, 0.2)]
    assert min(lowest) > -0.015
    assert max(lowest) < (0.15 if kind == "run" else 0.015)


@pytest.mark.parametrize("kind", fast_and_slow(*SINGLE))
def test_everything_begins_upright_with_the_arms_down(kind):
    first = dict(zip(NAMES, landmarks(kind)[0], strict=True))
    assert first["head_top"][2] > 1.6 * first["pelvis"][2]
    for side in ("left", "right"):
        assert first[f"{side}_hand"][2] < first["pelvis"][2]
        assert first[f"{side}_ankle"][2] < 0.15


@pytest.mark.parametrize("kind", fast_and_slow(*SINGLE))
def test_people_stay_near_the_centre(kind):
    farthest = np.linalg.norm(landmarks(kind)[:, NAMES.index("pelvis"), :2], axis=1).max()
    assert farthest < 1.7


def test_walking_feet_do_not_slide():
    body, motion = person(0), motions("walk")[0]
    times = np.arange(1.0, 2.4, 1.0 / FPS)
    skins = np.stack([body.posed(motion(float(t))).vertices for t in times])
    slow = []
    for before, after in pairwise(skins):
        low = np.argsort(before[:, 2])[:6]
        slow.append(np.linalg.norm(after[low, :2] - before[low, :2], axis=1).mean() * FPS)
    assert np.median(slow) < 0.1
    assert np.mean(np.array(slow) < 0.4) > 0.8


def test_walking_gets_on_at_a_natural_speed_and_swings_the_arms():
    points = landmarks("walk")
    pelvis = points[:, NAMES.index("pelvis"), :2]
    speed = np.linalg.norm(np.diff(pelvis[45:], axis=0), axis=1) * FPS
    assert 0.8 < speed.mean() < 1.5
    hands = points[45:, NAMES.index("left_hand"), :2] - pelvis[45:]
    assert np.linalg.norm(hands, axis=1).max() > np.linalg.norm(hands, axis=1).min() + 0.1


def test_arms_go_up_and_cross_in_front_of_the_trunk():
    points = dict(zip(NAMES, landmarks("arms").swapaxes(0, 1), strict=True))
    assert (points["left_hand"][:, 2] > points["head_top"][:, 2]).any()
    left = np.linalg.norm(points["left_hand"] - points["right_shoulder"], axis=1)
    own = np.linalg.norm(points["left_hand"] - points["left_shoulder"], axis=1)
    assert (left < own).any()


def test_a_squat_is_deep_and_a_kick_is_high():
    points = dict(zip(NAMES, landmarks("squat_kick").swapaxes(0, 1), strict=True))
    assert points["pelvis"][:, 2].min() < 0.68 * points["pelvis"][0, 2]
    assert points["right_toe"][:, 2].max() > 0.7 * points["pelvis"][0, 2]


def test_a_cartwheel_turns_upside_down_on_the_hands():
    points = dict(zip(NAMES, landmarks("cartwheel").swapaxes(0, 1), strict=True))
    upright = points["head_top"][:, 2] - points["pelvis"][:, 2]
    top = int(np.argmin(upright))
    assert upright[top] < -0.5
    for side in ("left", "right"):
        assert points[f"{side}_hand"][top, 2] < 0.08
        assert points[f"{side}_toe"][top, 2] > 1.4
    after = int(2 * top)
    assert upright[after] > 0.5
    way = points["pelvis"][after, :2] - points["pelvis"][0, :2]
    assert np.linalg.norm(way) > 2.0


@pytest.mark.parametrize("case", fast_and_slow(("pass", 2), ("walk", 3), ("cartwheel", 2), ("arms", 2)))
def test_people_never_go_through_one_another(case):
    kind, count = case
    bodies, closest = people(count), np.inf
    for time in np.arange(0.0, 3.0, 0.25):
        skins = [
            body.posed(motion(float(time))).vertices for body, motion in zip(bodies, motions(kind, count), strict=True)
        ]
        for k, skin in enumerate(skins[:-1]):
            tree = cKDTree(skin)
            closest = min(closest, *(tree.query(other[::3])[0].min() for other in skins[k + 1 :]))
    assert closest > 0.04


def test_passing_people_pass_closely():
    times = np.arange(0.0, 3.0, 0.05)
    paths = np.array([[motion(float(t)).position[:2] for motion in motions("pass", 2)] for t in times])
    distance = np.linalg.norm(paths[:, 0] - paths[:, 1], axis=1)
    assert 0.5 < distance.min() < 0.75
    assert distance[0] > 0.9


@pytest.mark.parametrize("path", [circle((0.2, 0.0), 0.9, 1.0, -1.0), egg(2.2, 1.7, 0.4)])
def test_a_path_is_parametrised_by_its_length_and_its_heading(path):
    for metres in np.linspace(0.0, 14.0, 57):
        (here, heading), (ahead, _) = path(float(metres)), path(float(metres) + 1e-3)
        step = (ahead - here) / 1e-3
        assert np.linalg.norm(step) == pytest.approx(1.0, abs=0.02)
        assert step @ [np.cos(heading), np.sin(heading)] == pytest.approx(1.0, abs=0.02)


def test_the_shoulders_do_not_rise_above_the_head():
    for kind in SINGLE:
        frames = person(0).anatomy.world_from_joint(motions(kind)[0](0.0))
        assert frames[INDEX["left_shoulder"], 2, 3] < frames[INDEX["head"], 2, 3]
