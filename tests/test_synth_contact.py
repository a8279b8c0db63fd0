"""Yardsticks: people who run, sit, throw, stoop, dance and fight as people can, and touch only what they should."""

from functools import cache

import numpy as np
import pytest
from body_cases import shipped
from scipy.spatial import cKDTree
from synth_people import depth_of_hands_in_trunk, depth_of_others, human_angles, motions, people, person

from sogjax.synth.anatomy import INDEX
from sogjax.synth.furniture import (
    AROUND,
    BOARD_HEIGHTS,
    BOARD_SIZE,
    COUNTER_SIZE,
    EDGE,
    SEAT_HEIGHT,
    TABLE_HEIGHT,
    TABLE_SIZE,
    farther,
)
from sogjax.synth.motions import furniture_sites, motions_of
from sogjax.synth.settings import MOTIONS, PAIRED

pytestmark = pytest.mark.slow

SINGLE = ("walk", "arms", "run", "sit", "throw", "dance", "stoop")
PEOPLE = dict.fromkeys(SINGLE, 1) | dict.fromkeys(("pass", *PAIRED), 2)
TIMES = {"sit": 6.0, "dance": 6.3, "stoop": 5.5, "hug": 4.4, "fight": 6.2, "embrace": 5.0, "talk": 5.0, "couple": 6.4}
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


@pytest.mark.parametrize("kind", ["pass", *PAIRED])
def test_two_people_touch_without_going_into_each_other(kind):
    depths = [depth_of_others(people(2), poses) for poses in poses_of(kind, 0.2)]
    if kind in ("pass", "talk"):
        assert max(depths) < -0.01
    else:
        assert -0.02 < max(depths) < 0.03


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


@pytest.mark.parametrize("kind", sorted({*MOTIONS} - {"sit", "pass"}))
def test_nobody_goes_through_the_furniture(kind):
    """Where tables, chairs at their ends, counters and boards stand."""
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
            away = skin - farther(site).place
            a, b = np.abs(away @ along), np.abs(away @ np.array([-along[1], along[0], 0.0]))
            at_counter = (a < 0.5 * COUNTER_SIZE[0]) & (b < 0.5 * COUNTER_SIZE[1]) & (skin[:, 2] < COUNTER_SIZE[2])
            beside = (skin[:, 2] > BOARD_HEIGHTS[0]) & (skin[:, 2] < BOARD_HEIGHTS[1])
            at_board = (a < 0.5 * BOARD_SIZE[0]) & (b < 0.5 * BOARD_SIZE[1]) & beside
            assert not (at_table | at_chair | at_counter | at_board).any()


@pytest.mark.parametrize("kind", MOTIONS)
def test_screens_and_fences_stand_around_all_that_people_do(kind):
    for poses in poses_of(kind, 0.2):
        for body, pose in zip(people(len(poses)), poses, strict=True):
            assert np.linalg.norm(body.posed(pose).vertices[:, :2], axis=1).max() < AROUND - 0.05


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


def apart(poses):
    """Metres between two people's hips."""
    return float(np.linalg.norm(np.subtract(*(pose.position[:2] for pose in poses))))


def feet_of(kind, number, step=0.2):
    """Ankles of a person over time."""
    body = person(number)
    frames = [body.anatomy.world_from_joint(poses[number]) for poses in poses_of(kind, step)]
    return np.stack([[each[INDEX[f"{side}_ankle"], :3, 3] for side in ("left", "right")] for each in frames])


@pytest.mark.parametrize("kind", ["talk", "embrace", "couple"])
def test_some_people_never_stand_apart(kind):
    distances = np.array([apart(poses) for poses in poses_of(kind, 0.1)])
    assert distances.max() < 0.9
    if kind == "talk":
        assert distances.min() > 0.7
    else:
        assert np.mean(distances < 0.6) > 0.7


@pytest.mark.parametrize(("kind", "people_"), [("talk", 2), ("stoop", 1)])
def test_some_people_hardly_leave_their_place(kind, people_):
    for number in range(people_):
        feet = feet_of(kind, number)
        assert np.ptp(feet, axis=0)[..., :2].max() < 0.05


def test_who_stoops_reaches_the_floor_and_over_the_head():
    stoop, body = motions("stoop")[0], person(0)
    frames = np.stack([body.anatomy.world_from_joint(stoop(float(t))) for t in np.arange(0.0, 6.0, 0.1)])
    wrists = frames[:, [INDEX["left_wrist"], INDEX["right_wrist"]], 2, 3]
    assert wrists.min() < 0.3
    assert wrists.max() > 1.1 * body.anatomy.stature
    assert frames[:, INDEX["head"], 2, 3].min() < 0.7 * body.anatomy.stature


def test_people_who_talk_move_their_hands_and_turn_a_little():
    for number, act in enumerate(motions("talk", 2)):
        frames = [person(number).anatomy.world_from_joint(act(float(t))) for t in np.arange(0.0, 2.0, 0.1)]
        hands = np.stack([[f[INDEX[f"{side}_wrist"], :3, 3] for side in ("left", "right")] for f in frames])
        assert np.linalg.norm(np.diff(hands, axis=0), axis=-1).sum(0).min() > 0.3
        ahead = np.unwrap([np.arctan2(f[INDEX["chest"], 1, 0], f[INDEX["chest"], 0, 0]) for f in frames])
        assert 3.0 < np.rad2deg(np.ptp(ahead)) < 40.0


@pytest.mark.slow
def test_a_couple_turns_round_once_with_hands_together_on_feet_that_stand():
    acts = motions("couple", 2)
    between = lambda t: np.subtract(*(act(float(t)).position[:2] for act in acts))
    ways = np.array([between(t) for t in np.arange(0.0, 6.4, 0.05)])
    angles = np.unwrap(np.arctan2(ways[:, 1], ways[:, 0]))
    assert angles[-1] - angles[0] == pytest.approx(2.0 * np.pi, abs=0.05)
    for time in np.arange(0.7, 5.0, 0.3):
        one, other = (person(k).anatomy.world_from_joint(act(float(time))) for k, act in enumerate(acts))
        assert np.linalg.norm(one[INDEX["left_wrist"], :3, 3] - other[INDEX["right_wrist"], :3, 3]) < 0.2
    for number in range(2):
        feet = feet_of("couple", number, 0.02)
        speed = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) / 0.02
        assert np.median(speed.min(axis=1)) < 0.02
        assert speed.min(axis=1).max() < 0.2
