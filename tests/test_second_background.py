"""When a background is learnt a second time."""

import jax.numpy as jnp
import numpy as np
import pytest

from sogjax.run import second_background
from sogjax.run.job import Job
from sogjax.run.kept_run import KeptRun
from sogjax.settings.method import ImagesConfig
from sogjax.tracking.tracker import Tracker


def part_of_a_clip(first, stop):
    """A job that tracks some frames; nothing else of it is looked at."""
    job = object.__new__(Job)
    for name, value in {
        "frames": (first, stop),
        "tracker": object.__new__(Tracker),
        "grids": (),
        "recording": None,
    }.items():
        object.__setattr__(job, name, value)
    return job


@pytest.mark.parametrize(("first", "stop", "learns"), [(110, 190, False), (0, 300, True)])
def test_a_part_with_too_few_samples_is_not_tracked_for_its_background(monkeypatch, first, stop, learns):
    tracked = []
    monkeypatch.setattr(second_background, "unknown_share", lambda *_: 0.5)
    monkeypatch.setattr(second_background, "sampled_frames", lambda _: [*range(0, 300, 30)])
    monkeypatch.setattr(second_background, "_first_pass", lambda *_: tracked.append(True) or {})
    monkeypatch.setattr(second_background, "knowing_the_body", lambda tracker, *_: tracker)
    job = part_of_a_clip(first, stop)
    assert second_background.learnt_again(job, ImagesConfig(), lambda *_: iter(())) is job.tracker
    assert bool(tracked) == learns


def test_a_background_is_learnt_again_from_the_poses_that_were_kept(monkeypatch, tmp_path):
    """A run that is resumed does not track the clip for its background a second time."""
    found, learnt = {30: jnp.arange(3.0), 60: jnp.ones(3)}, []
    monkeypatch.setattr(second_background, "unknown_share", lambda *_: 0.5)
    monkeypatch.setattr(second_background, "sampled_frames", lambda _: [*range(0, 300, 30)])
    monkeypatch.setattr(second_background, "_first_pass", lambda *_: found)
    monkeypatch.setattr(second_background, "knowing_the_body", lambda *given: learnt.append(given[-1]) or given[0])
    for _ in range(2):
        kept = KeptRun(tmp_path)
        kept.begin("track", {})
        second_background.learnt_again(part_of_a_clip(0, 300), ImagesConfig(), lambda *_: iter(()), kept=kept)
        monkeypatch.setattr(second_background, "_first_pass", lambda *_: pytest.fail("tracked again"))
    assert learnt[1].keys() == found.keys()
    for frame, pose in learnt[1].items():
        np.testing.assert_array_equal(pose, found[frame])
