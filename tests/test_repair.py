"""Repair: when a limb is tried elsewhere, and when it stays there."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_scene import landmark_error, moved, standing
from walking_dog import HEIGHT

from sogjax.engine import build
from sogjax.errors import InputError
from sogjax.settings.compose import track_config
from sogjax.tracking.frame import TrackState
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.limb_doubt import Judgement
from sogjax.tracking.limbs import limb_blobs, limb_names, limbs
from sogjax.tracking.mirrored import means_of
from sogjax.tracking.repair import LASTING, NUM_CLIMBED, NUM_TRIED, Repair

LIMB = 4


@pytest.fixture(scope="module")
def dog(walking_dog):
    """The tracker, and the first frame: its pose, its cells, and as it was tracked."""
    tracker, cells, passed = walking_dog
    pose = standing(tracker.body, HEIGHT)
    first = next(track(tracker, jnp.asarray(pose), cells[:1], passed.capacities))
    return tracker, pose, cells[0], first


class Scripted:
    """Steps and judgements with given doubts about one limb, counted."""

    def __init__(self, dog, elsewhere=0.1, energy=0.0):
        self.tracker, pose, _, first = dog
        self.result = jax.tree.map(jnp.asarray, first.result)
        self.state = self.tracker.start(pose)
        self.elsewhere, self.energy = elsewhere, energy
        self.steps = self.judged = 0

    def found(self, doubt, energy=0.0):
        result = self.result
        doubts = jnp.zeros(len(limb_names(self.tracker.body))).at[LIMB].set(doubt)
        limbs = Judgement(doubts, jnp.asarray(result.limbs.usual))
        return self.state, replace(result, limbs=limbs, energy=jnp.asarray(float(result.energy) + energy))

    def step(self, state):
        self.steps += 1
        return self.found(self.elsewhere, self.energy)

    def judge(self, state, poses):
        self.judged += len(poses)
        return jnp.zeros((len(poses), len(limb_names(self.tracker.body))))


def test_nothing_is_done_while_no_limb_is_in_doubt(dog):
    repair, script = Repair(dog[0].body), Scripted(dog)
    for _ in range(5):
        found = script.found(0.3)
        assert repair.after(script.state, found, script.step, script.judge) is found
    assert script.steps == script.judged == 0


def test_a_limb_stays_elsewhere_when_it_was_better_for_some_frames(dog):
    repair, script = Repair(dog[0].body), Scripted(dog)
    for frame in range(LASTING):
        _, result = repair.after(script.state, script.found(0.9), script.step, script.judge)
        assert float(result.limbs.doubt[LIMB]) == pytest.approx(0.1 if frame == LASTING - 1 else 0.9)
    assert script.judged == NUM_TRIED
    assert script.steps <= NUM_CLIMBED + LASTING - 1


@pytest.mark.parametrize(("elsewhere", "energy"), [(0.8, 0.0), (0.1, -1.0)], ids=["as doubtful", "less energy"])
def test_a_limb_that_is_no_better_elsewhere_stays_where_it_is(dog, elsewhere, energy):
    repair, script = Repair(dog[0].body), Scripted(dog, elsewhere, energy)
    for _ in range(2 * LASTING):
        found = script.found(0.9)
        assert repair.after(script.state, found, script.step, script.judge) is found
    assert script.judged == 2 * NUM_TRIED  # with a pause between


def test_a_trial_that_gets_worse_is_given_up(dog):
    repair, script = Repair(dog[0].body), Scripted(dog)
    repair.after(script.state, script.found(0.9), script.step, script.judge)
    script.elsewhere = 0.9
    for _ in range(LASTING):
        found = script.found(0.9)
        assert repair.after(script.state, found, script.step, script.judge) is found


def test_no_pose_is_tried_that_moves_another_limb_or_leaves_the_limits(dog):
    tracker = dog[0]
    repair, tried = Repair(tracker.body), []
    script = Scripted(dog)
    repair.after(script.state, script.found(0.9), script.step, lambda s, p: tried.append(p) or script.judge(s, p))
    poses, dofs = np.asarray(tried[0]), limbs(tracker.body.skeleton)[LIMB]
    others = np.setdiff1d(np.arange(poses.shape[1]), dofs)
    np.testing.assert_array_equal(poses[:, others], np.tile(script.found(0.9)[1].pose[others], (len(poses), 1)))
    lower, upper = np.asarray(tracker.body.skeleton.dof_lower), np.asarray(tracker.body.skeleton.dof_upper)
    assert (poses[:, dofs] >= lower[dofs] - 1e-5).all()
    assert (poses[:, dofs] <= upper[dofs] + 1e-5).all()
    assert np.ptp(means_of(tracker.body, poses)[:, limb_blobs(tracker.body)[LIMB]], axis=0).max() > 0.1


@pytest.mark.slow
def test_a_limb_that_was_displaced_is_put_back(dog):
    tracker, pose, cells, first = dog
    wrong = moved(tracker.body, pose, {"left_front_swing": 1.4, "left_front_side": 0.5, "left_elbow": -1.2})
    usual = jnp.asarray(first.result.limbs.usual)
    error = {}
    for repairs in (False, True):
        start = TrackState(jnp.asarray(wrong), jnp.asarray(wrong), jnp.asarray(2), usual)
        end = [*track(replace(tracker, repairs=repairs), start, [cells] * 10)][-1].result
        error[repairs] = landmark_error(tracker.body, end.pose, pose)
    assert error[True] < 0.02
    assert error[True] <= error[False] + 1e-3


def test_limbs_that_are_not_judged_cannot_be_repaired():
    with pytest.raises(InputError, match=r"tracking\.repair=true outputs\.confidence=false"):
        build.check(track_config(["tracking.repair=true", "outputs.confidence=false"], recording=""))
