"""When a background is learnt a second time."""

import pytest

from sogjax.engine import second_background
from sogjax.engine.job import Job
from sogjax.settings import ImagesConfig
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
