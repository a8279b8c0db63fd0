"""Actors that are kept for trials are those of a recording, all of them or none."""

from dataclasses import replace

import pytest
from command_line import actor_file, trackable
from verdict_trials import VerdictTrials

from sogjax.io.actor_file import load_body, save_body
from sogjax.run.actors import Actors
from sogjax.study import tracked
from sogjax.study.few_cameras import Trials
from sogjax.synth.settings import SynthSettings

NAMES = ["ben", "anna"]


@pytest.fixture
def source(tmp_path, monkeypatch):
    """A recording of two people, made to actors without looking at it."""
    body = load_body(actor_file(tmp_path / "actor.yaml"))
    made = [replace(body, name=name) for name in NAMES]
    monkeypatch.setattr(tracked, "make_actors", lambda request: Actors(tuple(made)))
    folder = trackable(tmp_path / "two")
    for module in ("sogjax.study.few_cameras", "verdict_trials"):
        monkeypatch.setattr(f"{module}.cached_recording", lambda _: folder)
    return folder


@pytest.mark.parametrize("kind", [Trials, VerdictTrials])
def test_half_of_them_are_not_taken_for_all(source, tmp_path, monkeypatch, kind):
    def stopped_after_one(path, body):
        if body.name != NAMES[0]:
            raise KeyboardInterrupt
        save_body(path, body)

    trials = kind(tmp_path / "out", {"walk": SynthSettings()}, 60)
    with monkeypatch.context() as changed:
        changed.setattr(tracked, "save_body", stopped_after_one)
        with pytest.raises(KeyboardInterrupt):
            trials._actors("walk")
    assert [body.name for body in trials._actors("walk")] == NAMES
    monkeypatch.setattr(tracked, "make_actors", None)
    assert [body.name for body in trials._actors("walk")] == NAMES


def test_another_process_may_be_faster(source, tmp_path, monkeypatch):
    def beaten(path, body):
        save_body(path, body)
        save_body(tmp_path / "kept" / path.name, body)

    monkeypatch.setattr(tracked, "save_body", beaten)
    assert [body.name for body in tracked.kept_actors(tmp_path / "kept", source)] == NAMES
