"""Yardsticks: people who run, sit, throw, dance, embrace and fight as people can, and touch only what they should."""

from functools import cache

import numpy as np
import pytest
from body_cases import shipped
from scipy.spatial import cKDTree
from synth_people import depth_of_hands_in_trunk, depth_of_others, human_angles, motions, people, person

from sogjax.synth.anatomy import INDEX
from sogjax.synth.motions import furniture_sites, motions_of
from sogjax.synth.rooms import EDGE, SEAT_HEIGHT, TABLE_HEIGHT, TABLE_SIZE

PEOPLE = {"walk": 1, "arms": 1, "run": 1, "sit": 1, "throw": 1, "dance": 1, "pass": 2, "hug": 2, "fight": 2}
TIMES = {"sit": 6.0, "dance": 6.3, "hug": 4.4, "fight": 6.2}
"""Seconds until the motion begins again; a little more than 3 where it is not named."""


@cache
def poses_of(kind, step, furnished=False):
    """The poses of all people of a motion from time to time."""
    acts = motions(kind, PEOPLE.get(kind, 1), furnished)
    return [[act(float(time)) for act in acts] for time in np.arange(0.0, TIMES.get(kind, 3.2), step)]


@pytest.mark.parametrize("kind", sorted(PEOPLE))
def test_joints_stay_within_the_limits_of_the_human_body(kind):
    skeleton = shipped("human").skeleton
    limits = np.rad2deg(np.stack([skeleton.dof_lower, skeleton.dof_upper], 1))
    limit = dict(zip(skeleton.dof_names, limits, strict=True))
    for poses in poses_of(kind, 0.2):
        for pose in poses:
            beyond = {n: a for n, a in human_angles(pose).items() if not limit[n][0] - 2.0 < a < limit[n][1] + 2.0}
            assert not beyond


@pytest.mark.parametrize("kind", sorted(PEOPLE))
def test_hands_do_not_go_into_the_own_trunk(kind):
    for poses in poses_of(kind, 0.3):
        for body, pose in zip(people(len(poses)), poses, strict=True):
            assert depth_of_hands_in_trunk(body, pose) < 0.0


@pytest.mark.parametrize("kind", ["pass", "hug", "fight"])
def test_two_people_touch_without_going_into_each_other(kind):
    depths = [depth_of_others(people(2), poses) for poses in poses_of(kind, 0.2)]
    assert max(depths) < 0.03
    assert (max(depths) > -0.02) == (kind != "pass")


def test_running_is_fast_and_has_a_flight_phase():
    body, run = person(0), motions("run")[0]
    times = np.arange(1.2, 3.2, 1.0 / 30.0)
    way = np.array([run(float(t)).position[:2] for t in times])
    assert 3.0 < np.linalg.norm(np.diff(way, axis=0), axis=1).mean() * 30.0 < 4.0
    lowest = np.array([body.posed(run(float(t))).vertices[:, 2].min() for t in times])
    assert 0.2 < np.mean(lowest > 0.02) < 0.6
    frames = np.stack([body.anatomy.world_from_joint(run(float(t))) for t in times])
    for side in ("left", "right"):
        shoulder, elbow, wrist = (frames[:, INDEX[f"{side}_{j}"], :3, 3] for j in ("shoulder", "elbow", "wrist"))
        upper, lower = elbow - shoulder, wrist - elbow
        cosine = (upper * lower).sum(1) / np.linalg.norm(upper, axis=1) / np.linalg.norm(lower, axis=1)
        assert np.rad2deg(np.arccos(cosine)).min() > 75.0


def test_running_feet_stand_still_while_they_carry():
    body, run = person(0), motions("run")[0]
    for time in np.arange(1.2, 2.6, 1.0 / 30.0):
        before, after = (body.posed(run(float(t))).vertices for t in (time, time + 0.01))
        low = np.argsort(before[:, 2])[:6]
        if before[low, 2].mean() < 0.0:
            assert np.linalg.norm((after - before)[low, :2], axis=1).mean() / 0.01 < 0.8


@pytest.mark.parametrize("number", [0, 3])
def test_a_sitter_sits_on_the_chair_with_hands_on_the_table_and_legs_below(number):
    body, site = person(number), furniture_sites("sit", 1, np.random.default_rng(1))[0]
    act = motions_of("sit", [body.anatomy], np.random.default_rng(1))[0]
    hands_on_table, on_seat = [], []
    for time in np.arange(0.0, 6.2, 0.1):
        skin = body.posed(act(float(time))).vertices
        beyond = (skin - site.place) @ [-np.sin(site.turn), np.cos(site.turn), 0.0] + 0.5 * TABLE_SIZE[1]  # the edge
        within_top = (beyond > 0.015) & (skin[:, 2] > TABLE_HEIGHT - 0.025) & (skin[:, 2] < TABLE_HEIGHT - 0.01)
        assert not within_top.any()
        hands_on_table.append(((beyond > 0.05) & (np.abs(skin[:, 2] - TABLE_HEIGHT) < 0.02)).any())
        behind = (beyond + EDGE < -0.25) & (skin[:, 2] < 0.9)
        on_seat.append(behind.any() and abs(skin[behind, 2].min() - SEAT_HEIGHT) < 0.025)
    assert sum(hands_on_table) > 20
    assert all(on_seat[13:45])
    assert not any(on_seat[:5])


@pytest.mark.parametrize("kind", ["walk", "run", "arms", "squat_kick", "throw", "dance", "cartwheel", "hug", "fight"])
def test_nobody_goes_through_the_furniture(kind):
    """Neither where the table stands nor where the chairs at its ends stand."""
    count = PEOPLE.get(kind, 1)
    site = furniture_sites(kind, count, np.random.default_rng(1))[0]
    along = np.array([np.cos(site.turn), np.sin(site.turn), 0.0])
    for poses in poses_of(kind, 0.2, furnished=True):
        for body, pose in zip(people(count), poses, strict=True):
            skin = body.posed(pose).vertices
            offset = skin - site.place
            a, b = np.abs(offset @ along), np.abs(offset @ np.array([-along[1], along[0], 0.0]))
            at_table = (a < 0.5 * TABLE_SIZE[0]) & (b < 0.5 * TABLE_SIZE[1]) & (skin[:, 2] < TABLE_HEIGHT)
            at_chair = (a < 0.90) & (b < 0.22) & (skin[:, 2] < 0.9)
            assert not (at_table | at_chair).any()


def test_an_embrace_is_close_and_ends():
    bodies, acts = people(2), motions("hug", 2)
    apart = lambda time: np.linalg.norm(np.subtract(*(act(time).position for act in acts)))
    assert apart(0.0) > 1.4
    assert apart(2.1) < 0.5
    assert apart(4.3) > 1.4
    skins = [body.posed(act(2.1)).vertices for body, act in zip(bodies, acts, strict=True)]
    frames = [body.anatomy.world_from_joint(act(2.1)) for body, act in zip(bodies, acts, strict=True)]
    for own, other in ((0, 1), (1, 0)):
        chest = frames[other][INDEX["chest"]]
        for side in ("left", "right"):
            wrist = frames[own][INDEX[f"{side}_wrist"], :3, 3]
            assert (wrist - chest[:3, 3]) @ chest[:3, 0] < 0.02  # behind the middle of the other one's chest
            assert cKDTree(skins[other]).query(wrist)[0] < 0.12


def test_punches_stop_at_the_guard_and_the_kick_meets_the_body():
    bodies, acts = people(2), motions("fight", 2)
    skins = [body.posed(act(2.45)).vertices for body, act in zip(bodies, acts, strict=True)]
    ankle = bodies[0].anatomy.world_from_joint(acts[0](2.45))[INDEX["right_ankle"], :3, 3]
    assert ankle[2] > 0.6
    gap, _ = cKDTree(skins[1]).query(skins[0][np.linalg.norm(skins[0] - ankle, axis=1) < 0.25])
    assert gap.min() < 0.05
    # A straight right arm ends a hand's length before the face.
    fist = bodies[0].anatomy.world_from_joint(acts[0](0.97))[INDEX["right_wrist"], :3, 3]
    face = bodies[1].anatomy.world_from_joint(acts[1](0.97))[INDEX["head"], :3, 3]
    assert 0.15 < np.linalg.norm(fist - face) < 0.35


def test_a_throw_is_overarm_and_fast():
    body, throw = person(0), motions("throw")[0]
    times = np.arange(0.0, 2.0, 0.01)
    hand = np.stack([body.anatomy.world_from_joint(throw(float(t)))[INDEX["right_wrist"], :3, 3] for t in times])
    speed = np.linalg.norm(np.diff(hand, axis=0), axis=1) / 0.01
    fastest = int(np.argmax(speed))
    assert speed[fastest] > 5.0
    assert 1.0 < times[fastest] < 1.4
    release = body.anatomy.world_from_joint(throw(1.16))
    assert release[INDEX["right_wrist"], 2, 3] > release[INDEX["head"], 2, 3]


def test_a_dancer_turns_round_once():
    dance = motions("dance")[0]
    ahead = np.stack([dance(float(t)).rotations[0][:2, 0] for t in np.arange(0.0, 6.4, 0.05)])
    angles = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    assert angles[-1] - angles[0] == pytest.approx(2.0 * np.pi, abs=0.05)
