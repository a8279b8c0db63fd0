"""Whole actors turned back to front: what is tried, where, and that it is found."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body, shipped
from drawn_scene import cells_of, colored, draw, in_colors, standing
from rig_cases import ring_rig
from test_both_ways import reader
from walking_dog import DEPTH, judging_tracker, pass_of

from sogjax.model.body import concatenate
from sogjax.run.merge import turning_rows
from sogjax.search.body_parts import body_parts
from sogjax.search.limb_search import LimbSearch
from sogjax.search.merge_passes import merge_passes
from sogjax.search.mirrored import look_alikes, other_side
from sogjax.search.placed_body import means_of
from sogjax.search.turned_body import turned, turned_pose
from sogjax.tracking.frame import on_device
from sogjax.tracking.frame_by_frame import track

HUMAN = shipped("human")
FRAMES, SPEED = 9, 0.01


def test_actors_are_turned_in_the_middle_of_equal_parts_of_a_clip():
    assert turning_rows(60, 30.0) == [10, 30, 50]
    assert turning_rows(1, 30.0) == [0]
    long = turning_rows(1000, 50.0)
    assert max(np.diff([0, *long, 1000])) <= 100
    assert len(long) == 10


@pytest.mark.slow
@pytest.mark.parametrize("actor", [0, 1])
def test_one_of_two_actors_is_turned_in_all_ways_and_the_other_stays(actor):
    both = concatenate([replace(HUMAN, name="anna"), replace(HUMAN, name="ben")])
    one = np.asarray(HUMAN.poses["walk_left"], np.float32)
    pose = np.concatenate([one, one])
    whole = [part for part in body_parts(both) if part.whole is None][actor]
    others = turned(both, whole, pose, look_alikes(both, pose))
    assert len(others) == 3  # all sides exchanged, all but the arms, all but the legs
    moves = np.isin(np.arange(len(pose)), whole.dofs)
    np.testing.assert_array_equal(others[:, ~moves], np.tile(pose[~moves], (3, 1)))
    means, before = means_of(both, others), means_of(both, pose[None])[0]
    moved = np.linalg.norm(means - before, axis=-1)
    own = both.blob_actors == actor
    assert moved[:, ~own].max() < 1e-5
    assert moved[:, own].mean(axis=1).min() > 0.05


def test_a_body_without_sides_is_not_turned():
    thing = random_body(0)
    whole, pose = body_parts(thing)[0], np.zeros(thing.skeleton.num_dofs, np.float32)
    assert turned(thing, whole, pose, look_alikes(thing, pose)).shape == (0, len(pose))
    nothing = np.zeros((0, HUMAN.skeleton.num_dofs), np.float32)  # sides of joints alone
    pose = np.asarray(HUMAN.poses["rest"], np.float32)
    assert turned(HUMAN, body_parts(HUMAN)[0], pose, nothing).shape == (0, len(pose))


def alike_on_both_sides(body):
    """A body whose left is coloured as its right, as most people are."""
    sides = other_side(body.blobs.names)
    return colored(body, np.asarray(body.blob_colors)[np.minimum(sides, np.arange(len(sides)))])


@pytest.fixture(scope="module")
def back_to_front():
    """A tracker, the cells of somebody who goes sideways, and what is found from a pose back to front."""
    body, rig = alike_on_both_sides(in_colors(HUMAN)), ring_rig(5, (160, 120), distance=3.0)
    tracker = judging_tracker(body, rig)
    root = [name.startswith("root") for name in body.skeleton.dof_names]
    pose = np.where(root, standing(body, 1.0), np.asarray(body.poses["walk_left"])).astype(np.float32)
    poses = np.stack([pose] * FRAMES)
    poses[:, 0] += SPEED * np.arange(FRAMES)
    cells = [cells_of(rig, draw(body, jnp.asarray(pose), rig), DEPTH) for pose in poses]
    wrong = look_alikes(body, poses[0].astype(np.float32))[0]
    return tracker, cells, poses, pass_of([*track(tracker, jnp.asarray(wrong), cells)])


@pytest.mark.slow
def test_an_actor_that_is_followed_back_to_front_is_turned(back_to_front):
    tracker, cells, poses, passed = back_to_front
    off = lambda found: np.linalg.norm(
        means_of(tracker.body, np.stack(found)) - means_of(tracker.body, poses), axis=-1
    ).mean()
    assert off(passed.poses) > 0.1
    found = merge_passes(tracker, passed, reader(cells), range(0, FRAMES, 4), turning_rows(FRAMES, 30.0))
    assert found.parts["whole body"] == {*range(FRAMES)}
    assert off([found.frames[row].pose for row in range(FRAMES)]) < 0.03


@pytest.mark.slow
def test_an_actor_that_is_followed_rightly_is_not_turned(back_to_front):
    tracker, cells, poses, _ = back_to_front
    right = pass_of([*track(tracker, jnp.asarray(poses[0], jnp.float32), cells)])
    search = LimbSearch.of(tracker, right.capacities)
    wholes = [part for part in body_parts(tracker.body) if part.whole is None]
    assert all(turned_pose(search, wholes, cells[row], right, row) is None for row in turning_rows(FRAMES, 30.0))


@pytest.mark.slow
def test_more_poses_than_one_program_takes_are_climbed_as_few_are(back_to_front):
    tracker, cells, _, passed = back_to_front
    search, known = LimbSearch.of(tracker, passed.capacities), passed.poses[0]
    views = search.views(on_device(cells[0]), known)
    starts = known + np.linspace(-0.1, 0.1, 6, dtype=np.float32)[:, None]
    ends, gains = search.climbed(views, known, starts, np.full(6, 0.16))
    assert ends.shape == starts.shape
    one_end, one_gain = search.climbed(views, known, starts[5:], np.full(1, 0.16))
    np.testing.assert_allclose(ends[5], one_end[0], atol=1e-6)
    np.testing.assert_allclose(gains[5], one_gain[0], rtol=1e-4, atol=1e-6)
