"""Tracking both ways: which pass each part of the body is taken from, and what comes of it."""

from dataclasses import replace
from itertools import product

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import cells_of, draw, standing
from rig_cases import ring_rig
from walking_dog import DEPTH, FRAMES, HEIGHT, judging_tracker, pass_of

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.part_energy import PartIndex
from sogjax.energy.posed import History
from sogjax.model.body import concatenate
from sogjax.model.limbs import limb_names, limbs
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.metrics import stretches
from sogjax.search import merge_passes as both_ways
from sogjax.search.best_passes import best_passes
from sogjax.search.body_parts import PartArrays, body_parts, changes_between, merged_pose, select_parts, with_blobs
from sogjax.search.merge_passes import merge_passes
from sogjax.search.other_pass import REACH, BothSeen, Compared, part_gains
from sogjax.search.placed_body import means_of
from sogjax.tracking.capacity import views_near, with_room
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, on_device
from sogjax.tracking.frame_by_frame import track

LOST = slice(4, 7)
TWO = concatenate([shipped("human"), shipped("dog")])
COSTS = fitted_numbers().merge_passes


def test_a_limb_is_put_into_its_place_beside_an_actor_of_another_size():
    """Only its own actor is fitted; the arrays of the smaller one are padded."""
    parts = body_parts(TWO)
    rest, rng = np.asarray(TWO.poses["rest"]), np.random.default_rng(0)
    one, two = (jnp.asarray(rest + rng.normal(0.0, 0.05, rest.shape).astype(rest.dtype)) for _ in range(2))
    arrays, whole = PartArrays.of(TWO, parts), PartIndex.whole(TWO)
    found = np.asarray(arrays.mixed(TWO, one, two))
    for part, blobs, mixed in zip(parts, arrays.blobs, found, strict=True):
        if part.whole is not None:
            np.testing.assert_allclose(mixed, with_blobs(TWO, one, two, blobs, whole), atol=1e-3)
            others = TWO.blob_actors != part.whole
            assert np.abs(means_of(TWO, mixed[None]) - means_of(TWO, np.asarray(one)[None]))[0, others].max() < 1e-5
            assert np.abs(mixed - np.asarray(one)).max() > 0.01


def reader(cells, asked=None):
    def frames(rows):
        if asked is not None:
            asked.append(rows)
        return [cells[row] for row in rows]

    return frames


def with_lost_limb(walking_dog, doubt=0.9):
    """The pass with a leg bent far in some frames; the leg's number."""
    tracker, _, passed = walking_dog
    limb = next(k for k, name in enumerate(limb_names(tracker.body)) if "leg" in name)
    poses, doubts = passed.poses.copy(), np.zeros_like(passed.doubts)
    poses[LOST, limbs(tracker.body.skeleton)[limb][0]] += 0.8
    doubts[LOST, limb] = doubt
    return replace(passed, poses=poses, doubts=doubts), limb


@pytest.mark.slow
def test_a_lost_limb_comes_back_from_the_other_side(walking_dog):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog)
    found = merge_passes(tracker, passed, reader(cells))
    rows = sorted(found.frames)
    assert {*range(LOST.start, LOST.stop)} <= {*rows} <= {*range(LOST.start - 1, LOST.stop + 1)}
    assert found.parts == {limb_names(tracker.body)[limb]: {*rows}}
    body = tracker.body
    off = lambda poses: np.linalg.norm(means_of(body, poses) - means_of(body, right.poses[rows]), axis=-1).max()
    assert off(passed.poses[rows]) > 0.05
    # The other pass's own poses, which were climbed: as near as two passes are.
    assert off(np.stack([found.frames[row].pose for row in rows])) < 0.015


@pytest.mark.slow
@pytest.mark.parametrize("known_is_right", [True, False])
def test_a_limb_is_taken_from_a_pass_that_is_known_where_that_explains_it_better(walking_dog, known_is_right):
    tracker, cells, right = walking_dog
    lost, limb = with_lost_limb(walking_dog, doubt=0.0)  # nobody doubts it, so no other pass is looked for
    passed, known = (lost, right.poses) if known_is_right else (right, lost.poses)
    found = merge_passes(tracker, passed, reader(cells), known=known)
    expected = {*range(LOST.start, LOST.stop)} if known_is_right else set()
    assert expected <= {*found.frames} <= {row + k for row in expected for k in (-1, 0, 1)}
    assert found.parts.keys() == ({limb_names(tracker.body)[limb]} if known_is_right else set())
    for row, revised in found.frames.items():
        off = means_of(tracker.body, revised.pose[None]) - means_of(tracker.body, right.poses[[row]])
        assert np.linalg.norm(off, axis=-1).max() < 0.015


@pytest.mark.slow
def test_what_holds_then_is_said_with_it(walking_dog):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog)
    found = merge_passes(tracker, passed, reader(cells)).frames[LOST.start]
    assert found.terms["similarity"] > 0.9 * right.energy
    assert passed.doubts[LOST.start, limb] > 0.8
    np.testing.assert_allclose(found.judged.error_probability[limb], right.doubts[LOST.start, limb], atol=0.05)


@pytest.mark.slow
def test_nothing_is_read_where_no_limb_is_in_doubt(walking_dog):
    tracker, cells, _ = walking_dog
    asked = []
    passed, _ = with_lost_limb(walking_dog, doubt=0.1)
    assert not merge_passes(tracker, passed, reader(cells, asked)).frames
    assert asked == []


@pytest.mark.slow
def test_a_right_pass_stays_though_it_is_doubted(walking_dog):
    tracker, cells, right = walking_dog
    doubts = np.zeros_like(right.doubts)
    doubts[LOST] = 0.9
    asked = []
    assert not merge_passes(tracker, replace(right, doubts=doubts), reader(cells, asked)).frames
    assert asked == [range(LOST.stop - 1, -1, -1)]


@pytest.mark.slow
def test_a_clip_that_ends_in_doubt_is_looked_at_from_its_last_frame(walking_dog):
    tracker, cells, right = walking_dog
    doubts = np.zeros_like(right.doubts)
    doubts[-2:] = 0.9
    asked = []
    merge_passes(tracker, replace(right, doubts=doubts), reader(cells, asked))
    assert asked == [range(FRAMES - 1, -1, -1)]


@pytest.mark.slow
def test_a_clip_of_one_frame_that_is_in_doubt_is_looked_at_once(walking_dog):
    tracker, cells, right = walking_dog
    one = {name: getattr(right, name)[:1] for name in ("poses", "baseline", "energies")}
    only = replace(right, doubts=np.full_like(right.doubts[:1], 0.9), **one)
    asked = []
    assert not merge_passes(tracker, only, reader(cells, asked)).frames
    assert asked == [range(0, -1, -1)]


@pytest.mark.slow
def test_a_frame_that_two_passes_revise_counts_once(walking_dog, monkeypatch):
    """A part that was taken in two overlapping passes was taken in as many frames as are said to be revised."""
    tracker, cells, right = walking_dog
    parts = body_parts(tracker.body)
    doubts = np.zeros_like(right.doubts)
    doubts[[2, 8]] = 0.9

    def compared(tracker, passed, frames, parts, first, last):
        begin = last + 1
        column = lambda value: list(np.tile(np.where(np.arange(len(parts)) == 0, value, 0.0), (begin, 1)))
        poses = [right.poses[row] for row in reversed(range(begin))]
        gains, apart = column(10.0 * right.energy), column(2.0 * COSTS.apart)
        return Compared([*reversed(range(begin))], cells[:begin][::-1], poses, gains, apart, [1.0] * begin)

    monkeypatch.setattr(both_ways, "compared_backwards", compared)
    beside = replace(right, doubts=doubts, poses=right.poses + np.float32(0.02))
    found = merge_passes(tracker, beside, reader(cells))
    assert {*found.frames} == {*range(9)}
    assert found.parts == {parts[0].name: {*range(9)}}


@pytest.mark.parametrize(("near", "blocks"), [(300, 100), (200, 150)])
def test_what_needs_more_room_is_computed_again(near, blocks):
    rooms = []

    def compute(room):
        rooms.append(room)
        return room.near, (jnp.asarray(near), jnp.asarray(200), blocks)

    assert with_room(compute, Capacities(256, 256, 128)) == rooms[-1].near
    assert len(rooms) == 2
    assert rooms[-1].hold(near, 200, blocks)


@pytest.mark.slow
def test_what_tracking_left_to_be_gained_does_not_tell_poses_apart(walking_dog):
    """One pose is where it was tracked, the other a little short of that: both are climbed to the same."""
    tracker, cells, right = walking_dog
    row = LOST.start
    short = right.poses[row].copy()
    short[6:] += 0.03
    lost, _ = with_lost_limb(walking_dog)
    of = lambda other: BothSeen.of(tracker, cells[row], right.capacities, right.poses[row], other)
    climbed = {}
    gain = of(short).climbed_gain(climbed, row)
    assert abs(gain) < 0.2 * abs(of(short).gain)
    assert of(lost.poses[row]).climbed_gain(climbed, row) < -5.0 * abs(gain)
    assert of(short).climbed_gain(climbed, row) == pytest.approx(gain, abs=1e-4 * right.energy)
    wrong = {row: lost.poses[row]}
    assert of(short).climbed_gain(wrong, row) > gain + 1e-3 * right.energy  # the known pose is the one that is kept
    assert replace(right, poses=lost.poses).climbed == {}


@pytest.mark.slow
def test_what_sees_more_image_blobs_than_there_is_room_for_is_valued_with_more_room(walking_dog, monkeypatch):
    """Else blobs would be cut off, and poses valued by what is left."""
    tracker, cells, right = walking_dog
    passed, _ = with_lost_limb(walking_dog)
    small, row = Capacities(8, 8, right.capacities.blocks), LOST.start
    choices = PartArrays.of(tracker.body, body_parts(tracker.body))
    poses = [jnp.asarray(each.poses[row]) for each in (passed, right)]
    seen = [BothSeen.of(tracker, cells[row], room, *poses) for room in (small, right.capacities)]
    gains = [part_gains(tracker, each, choices) for each in seen]
    views = views_near(tracker, on_device(cells[row]), poses[0], right.capacities, REACH, poses[1])
    alone = lambda pose: FrameEnergy(tracker.body, views, History.unknown(pose), tracker.terms)(pose)
    assert seen[0].gain == pytest.approx(float(alone(poses[1]) - alone(poses[0])), rel=1e-3)
    np.testing.assert_allclose(*gains, rtol=1e-3, atol=1e-5 * right.energy)
    compared = both_ways.compared_backwards
    monkeypatch.setattr(
        both_ways, "compared_backwards", lambda t, p, *rest: compared(t, replace(p, capacities=right.capacities), *rest)
    )
    one, two = (merge_passes(tracker, each, reader(cells)) for each in (replace(passed, capacities=small), passed))
    assert one.parts == two.parts
    assert one.frames[row].energy == pytest.approx(two.frames[row].energy, rel=1e-4)


@pytest.mark.slow
def test_a_lost_limb_comes_back_though_a_camera_is_missing_in_some_frames(walking_dog):
    tracker, cells, _ = walking_dog
    passed, limb = with_lost_limb(walking_dog)
    present = np.arange(len(cells[0])) != 1
    some = [FrameInput(frame, present) if LOST.start <= k < LOST.stop else frame for k, frame in enumerate(cells)]
    found = merge_passes(tracker, passed, reader(some))
    assert found.parts.keys() == {limb_names(tracker.body)[limb]}
    assert {*range(LOST.start, LOST.stop)} <= {*found.frames}


@pytest.mark.slow
def test_a_limb_of_one_of_two_actors_comes_back(walking_dog):
    """Two dogs as one model: the part is named with its actor, and the other one stays."""
    dog = walking_dog[0].body
    body = concatenate([replace(dog, name="rex"), replace(dog, name="bello")])
    rig = ring_rig(5, (160, 120), distance=2.2)
    tracker = judging_tracker(body, rig)
    half = dog.skeleton.num_dofs
    pose = np.concatenate([np.asarray(standing(dog, HEIGHT, (0.0, y))) for y in (-0.5, 0.5)])
    cells = [cells_of(rig, draw(body, jnp.asarray(pose), rig), DEPTH)] * 8
    right = pass_of([*track(tracker, jnp.asarray(pose), cells)])
    limb = next(k for k, name in enumerate(limb_names(body)) if "bello" in name and "leg" in name)
    poses, doubts = right.poses.copy(), np.zeros_like(right.doubts)
    poses[LOST, limbs(body.skeleton)[limb][0]] += 0.8
    doubts[LOST, limb] = 0.9
    found = merge_passes(tracker, replace(right, poses=poses, doubts=doubts), reader(cells))
    assert found.parts.keys() == {limb_names(body)[limb]}
    assert {*range(LOST.start, LOST.stop)} <= {*found.frames}
    for row, revised in found.frames.items():
        assert np.abs(revised.pose[:half] - right.poses[row, :half]).max() < 0.02
        off = means_of(body, revised.pose[None]) - means_of(body, right.poses[[row]])
        assert np.linalg.norm(off, axis=-1).max() < 0.02


def test_stretches_join_over_short_gaps():
    marked = np.array([0, 1, 1, 0, 1, 0, 0, 0, 1], bool)
    assert stretches(marked) == [(1, 3), (4, 5), (8, 9)]
    assert stretches(marked, gap=3) == [(1, 5), (8, 9)]
    assert stretches(marked, at_least=2) == [(1, 3)]
    assert stretches(np.zeros(3, bool)) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("open_ends", [(False, False), (True, False), (True, True)])
def test_the_choice_over_time_is_the_best_of_all(seed, open_ends):
    random = np.random.default_rng(seed)
    worth, change = random.normal(size=9), random.uniform(0.0, 1.0, 9)

    def value(taken):
        inside = sum(0.5 * (change[t - 1] + change[t]) for t in range(1, 9) if taken[t] != taken[t - 1])
        ends = [cost * taken[t] for t, cost, free in zip((0, -1), change[[0, -1]], open_ends, strict=True) if not free]
        return worth @ taken - inside - sum(ends)

    found = best_passes(worth[:, None], changes_between(change, open_ends))[0] > 0
    assert value(found.astype(float)) == pytest.approx(
        max(value(np.array(way, float)) for way in product((0, 1), repeat=9))
    )


def test_limbs_are_left_where_the_trunk_is_elsewhere_and_slight_gains_are_none():
    parts = body_parts(shipped("dog"))
    limb = next(k for k, part in enumerate(parts) if part.whole is not None)
    apart, gains = np.full((6, len(parts)), 0.01), np.full((6, len(parts)), -0.1)
    apart[2:4, limb], gains[2:4, limb] = 2.0 * COSTS.apart, 10.0 * COSTS.change * COSTS.apart
    assert select_parts(parts, apart, gains, 1.0)[:, limb].tolist() == [False, False, True, True, False, False]
    assert not select_parts(parts, apart, np.where(gains > 0.0, 0.5 * COSTS.bias, 0.0), 1.0).any()
    apart[:, 0] = 2.0 * COSTS.apart
    assert not select_parts(parts, apart, gains, 1.0).any()


def test_a_limb_that_is_likely_lost_is_taken_for_a_slight_gain():
    parts = body_parts(shipped("dog"))
    limb = next(k for k, part in enumerate(parts) if part.whole is not None)
    apart, gains, doubts = np.full((6, len(parts)), 0.01), np.full((6, len(parts)), -0.1), np.zeros((6, len(parts)))
    apart[:, limb], gains[:, limb] = 2.0 * COSTS.apart, 0.5 * COSTS.bias
    ends = (True, True)
    assert not select_parts(parts, apart, gains, 1.0, ends, doubts).any()
    doubts[:, limb] = 0.9
    assert select_parts(parts, apart, gains, 1.0, ends, doubts)[:, limb].all()


def test_a_limb_is_taken_to_its_place_though_the_trunk_is_turned():
    body = shipped("human")
    parts = body_parts(body)
    limb = next(k for k, part in enumerate(parts) if part.name == "left arm")
    pose = np.asarray(body.poses["tpose"])
    other = pose.copy()
    other[3:6] += 0.1
    taken = np.arange(len(parts)) == limb
    means, others = means_of(body, np.stack([pose, other]))
    found = means_of(body, merged_pose(body, parts, pose, other, taken)[None])[0]
    off = lambda target: np.linalg.norm(found - target, axis=-1)
    assert off(others)[parts[limb].blobs].mean() < 0.03 < 0.05 < off(means)[parts[limb].blobs].mean()
    assert off(means)[~parts[limb].blobs].mean() < 0.01


def test_an_actor_is_not_turned_back_within_a_frame_where_its_limbs_would_fly():
    body = shipped("human")
    parts = body_parts(body)
    whole = next(k for k, part in enumerate(parts) if part.whole is None)
    apart, gains = np.zeros((8, len(parts))), np.zeros((8, len(parts)))
    apart[:, whole], gains[:, whole] = 0.13, [-0.01, -0.01, -0.01, 0.03, 0.03, 0.03, 0.03, 0.03]
    held = select_parts(parts, apart, gains, 1.0, (True, True))[:, whole]
    assert held.tolist() == [False] * 3 + [True] * 5
    apart[:, [k for k, part in enumerate(parts) if part.whole == whole]] = 1.0
    assert select_parts(parts, apart, gains, 1.0, (True, True))[:, whole].all()


def test_actors_are_parts_of_their_own():
    body = concatenate([replace(shipped("dog"), name="rex"), replace(shipped("dog"), name="bello")])
    parts = body_parts(body)
    assert [part.name for part in parts if part.whole is None] == ["rex/whole body", "bello/whole body"]
    assert sum(len(part.dofs) for part in parts if part.whole is None) == body.skeleton.num_dofs
    assert all(
        part.name.split("/")[0] == parts[part.whole].name.split("/")[0] for part in parts if part.whole is not None
    )


def test_a_limb_that_is_not_taken_stays_though_it_is_beyond_its_limits():
    body = shipped("human")
    parts, names = body_parts(body), list(body.skeleton.dof_names)
    limb = next(k for k, part in enumerate(parts) if part.name == "left arm")
    pose = np.asarray(body.poses["tpose"]).copy()
    beyond = next(k for k in parts[1].dofs if np.isfinite(body.skeleton.dof_upper[k]))
    assert beyond not in parts[limb].dofs, names[beyond]
    pose[beyond] = float(body.skeleton.dof_upper[beyond]) + 0.2
    other = pose.copy()
    other[parts[limb].dofs[0]] += 0.3
    found = merged_pose(body, parts, pose, other, np.arange(len(parts)) == limb)
    assert found[beyond] == pytest.approx(pose[beyond], abs=0.02)
