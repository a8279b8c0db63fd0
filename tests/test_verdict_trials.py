"""Verdicts beside the truth: wrong actors are made as they are called, and limbs are lost where they are far off."""

from dataclasses import replace
from types import SimpleNamespace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
import verdict_trials
from beside_truth import OFTEN
from motion_cases import walking_motion
from small_recording import make_recording
from tiny_body import make_body
from verdict_trials import CASES, VerdictTrial, VerdictTrials, judged_run, scaled

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import motion_from_poses
from sogjax.quality.verdict import verdicts
from sogjax.run.initial_pose import SOURCES
from sogjax.study.true_poses import limb_errors
from sogjax.synth.settings import SynthSettings

NAMES = ("left_elbow", "right_elbow", "root_tx")
TRIAL = VerdictTrial("walk", 4, "pictures", "own actor")


def truth_of(motion, names):
    columns = [motion.joint_names.tolist().index(name) for name in names]
    return GroundTruth(motion.fps, joints=motion.world_from_joint[:, columns][..., :3, 3].copy(), joint_names=names)


def judged(off, frames):
    motion = walking_motion()
    truth = truth_of(motion, NAMES)
    truth.joints[frames, 0] += [off, 0.0, 0.0]
    return judged_run(TRIAL, "anna", motion, truth, verdicts({"anna": motion}, {})["anna"])


@pytest.mark.parametrize(
    ("off", "frames", "lost"),
    [
        (0.2, slice(3, 8), {"left arm": 5}),
        (0.2, slice(3, 5), {}),
        (0.08, slice(0, 12), {}),
    ],
)
def test_a_limb_is_lost_where_it_is_far_off_for_some_frames(off, frames, lost):
    run = judged(off, frames)
    assert run.lost == lost
    assert run.right is not bool(lost)
    assert run.looks_right


@pytest.mark.slow
def test_a_larger_actor_is_larger_in_every_pose():
    body = make_body()
    pose = jnp.zeros(body.skeleton.num_dofs)
    before, after = body.posed_blobs(pose), scaled(body, 1.2).posed_blobs(pose)
    np.testing.assert_allclose(after.means, 1.2 * before.means, atol=1e-6)
    np.testing.assert_allclose(after.sigmas, 1.2 * before.sigmas, rtol=1e-6)


def test_wrong_actors_are_what_they_are_called():
    body, other = make_body(), replace(make_body(), name="other")
    (exchanged,) = CASES["red and blue exchanged"]([body], [])
    np.testing.assert_array_equal(exchanged.blob_colors[:, 0], body.blob_colors[:, 2])
    assert [one.name for one in CASES["another person"]([body], [other])] == [body.name]


def test_limbs_are_judged_where_the_truth_ends_before_the_motion():
    body = make_body()
    poses = np.zeros((4, body.skeleton.num_dofs))
    motion = motion_from_poses(body, poses, 25.0)
    truth = truth_of(motion, ("left_elbow", "left_hip"))
    shorter = replace(truth, joints=truth.joints[:3] + 0.01)
    errors = limb_errors([body], shorter, np.array([1, 2, 3]), poses[1:])
    assert np.isfinite(errors.limbs).all(axis=1).tolist() == [True, True, False]


class Tracking:
    """In place of tracking: the same motion each time, or an error; counts how often it was asked."""

    def __init__(self, motion):
        self.motion, self.error, self.count = motion, None, 0

    def __call__(self, *_, pose_sources):
        self.count += 1
        self.sources = pose_sources
        if self.error is not None:
            raise self.error
        return SimpleNamespace(result_so_far=SimpleNamespace(motions={"tiny": self.motion}))


@pytest.fixture
def tracking(tmp_path, monkeypatch):
    """Of a body whose elbow is at its limit in every frame."""
    body = make_body()
    limits = jnp.ones(body.skeleton.num_dofs)
    body = eqx.tree_at(lambda one: (one.skeleton.dof_lower, one.skeleton.dof_upper), body, (-limits, limits))
    poses = np.zeros((4, body.skeleton.num_dofs))
    poses[:, body.skeleton.dof_names.index("left_elbow")] = 1.0
    found = Tracking(motion_from_poses(body, poses, 25.0))
    clip = make_recording(tmp_path / "clip", ("left", "middle", "right"))
    monkeypatch.setattr(verdict_trials, "cached_recording", lambda _: clip)
    monkeypatch.setattr(verdict_trials, "track_recording", found)
    monkeypatch.setattr(VerdictTrials, "_actors", lambda *_: [body])
    monkeypatch.setattr(VerdictTrials, "_truth", lambda *_: truth_of(found.motion, ("left_elbow",)))
    return found


@pytest.fixture
def trials(tmp_path):
    return VerdictTrials(tmp_path / "out", {"walk": SynthSettings()}, 60)


@pytest.mark.slow
def test_joints_at_their_limits_are_named_of_kept_trials_as_well(tracking, trials):
    trial = replace(TRIAL, cameras=2)
    at_limit = ("look at left_elbow, at its limit in 100% of the frames",)
    (run,) = trials.judged(trial)
    assert run.verdict.findings == at_limit
    (again,) = trials.judged(trial, do=False)
    assert again.verdict.findings == at_limit
    assert tracking.count == 1


def test_a_moved_initial_pose_is_a_trial_of_its_own(tracking, trials, monkeypatch):
    monkeypatch.setattr(verdict_trials, "moved_starts", lambda *words: iter([words[-1]]))
    trials.judged(replace(TRIAL, cameras=2))
    assert tracking.sources == SOURCES
    trials.judged(replace(TRIAL, cameras=2, moved=3))
    assert tracking.sources[0](None) == [3]
    assert tracking.count == 2


def test_the_part_of_the_frames_in_which_a_joint_is_astray():
    assert judged(0.2, slice(3, 6)).astray == 3 / 12 > OFTEN
    assert judged(0.14, slice(3, 8)).astray == 0.0


def test_what_was_refused_is_tried_again(tracking, trials):
    trial, tracking.error = replace(TRIAL, cameras=2), InputError("no initial pose")
    for do in (True, False):
        (run,) = trials.judged(trial, do=do)
        assert run.refused == "no initial pose"
    assert tracking.count == 1
    tracking.error = None
    (run,) = trials.judged(trial)
    assert not run.refused
    assert run.verdict is not None


def test_trouble_with_the_disk_is_no_verdict(tracking, trials):
    tracking.error = InputError("the disk is full")
    tracking.error.__cause__ = OSError("no space left")
    with pytest.raises(InputError, match="the disk is full"):
        trials.judged(replace(TRIAL, cameras=2))
    assert trials.judged(replace(TRIAL, cameras=2), do=False) == []
