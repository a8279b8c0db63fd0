"""Whose actor a recording among several has, and how it is made."""

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from command_line import actor_file
from small_recording import named_recording

from sogjax.cli import actor as actor_command
from sogjax.cli.sweep import takes as sweep_takes
from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.recording_files import posed_subjects
from sogjax.model.body import Body
from sogjax.run.actors import Actors
from sogjax.settings.run import ActorConfig, TrackConfig


@pytest.fixture
def made(monkeypatch):
    """The recordings and names that actors are made of."""
    seen = []

    def run(config, name):
        seen.append((config.recording.rpartition("/")[2], config.subject))
        if "bad" in config.recording:
            raise InputError("no pose was found")
        if "broken" in config.recording:
            raise ArithmeticError("no such inverse")
        assert config.overwrite or not Path(config.out).exists()
        Path(config.out).parent.mkdir(exist_ok=True)
        actor_file(Path(config.out), lambda content: content.update(name=name))

    monkeypatch.setattr(sweep_takes.actor_command, "run", run)
    return seen


def test_a_subject_has_one_actor_made_of_the_take_with_example_poses(tmp_path, made):
    takes = [named_recording(tmp_path / name, "anna", poses=name == "poses") for name in ("first", "poses", "last")]
    subjects, config, failed = sweep_takes.Subjects(tmp_path / "actors", takes, True), TrackConfig(recording="r"), {}
    files = [subjects.actor_of(take, config, failed) for take in takes]
    assert files == [[str(tmp_path / "actors" / "anna.yaml")]] * 3
    assert made == [("poses", None)]
    assert load_body(tmp_path / "actors" / "anna.yaml").name == "anna"


def test_an_actor_beside_the_videos_goes_first_and_nobody_named_has_none(tmp_path, made):
    own, unnamed = named_recording(tmp_path / "own", "anna"), named_recording(tmp_path / "unnamed")
    actor_file(own / "actor.yaml")
    subjects = sweep_takes.Subjects(tmp_path / "actors", [own, unnamed], True)
    assert subjects.actor_of(own, TrackConfig(recording="r"), {}) == [str(own / "actor.yaml")]
    assert subjects.actor_of(unnamed, TrackConfig(recording="r"), {}) is None
    assert made == []


def test_the_next_take_is_tried_where_one_fails_and_the_failure_counts_for_all(tmp_path, made):
    takes = [named_recording(tmp_path / name, "anna", poses=True) for name in ("bad", "good")]
    assert sweep_takes.Subjects(tmp_path / "actors", takes, True).actor_of(takes[0], TrackConfig(recording="r"), {})
    assert [name for name, _ in made] == ["bad", "good"]
    alone, failed = named_recording(tmp_path / "bad_ben", "ben"), {}
    subjects = sweep_takes.Subjects(tmp_path / "actors", [alone], True)
    for _ in range(2):
        with pytest.raises(InputError, match="no actor of ben: no pose was found"):
            subjects.actor_of(alone, TrackConfig(recording="r"), failed)
    assert [name for name, _ in made] == ["bad", "good", "bad_ben"]


def test_any_error_is_a_reason_and_no_end_of_the_command(tmp_path, made):
    takes = [named_recording(tmp_path / name, "anna", poses=True) for name in ("broken", "good")]
    assert sweep_takes.Subjects(tmp_path / "actors", takes, True).actor_of(takes[0], TrackConfig(recording="r"), {})
    alone = named_recording(tmp_path / "broken_ben", "ben")
    with pytest.raises(InputError, match="no actor of ben: ArithmeticError: no such inverse"):
        sweep_takes.Subjects(tmp_path / "actors", [alone], True).actor_of(alone, TrackConfig(recording="r"), {})


@pytest.mark.parametrize(("overwrite", "times"), [(True, 1), (False, 0)])
def test_overwrite_makes_an_actor_anew_once_for_all_takes(tmp_path, made, overwrite, times):
    takes = [named_recording(tmp_path / name, "anna") for name in ("walk", "run")]
    (tmp_path / "actors").mkdir()
    actor_file(tmp_path / "actors" / "anna.yaml")
    subjects, failed = sweep_takes.Subjects(tmp_path / "actors", takes, True), {}
    for take in takes:
        subjects.actor_of(take, TrackConfig(recording="r", overwrite=overwrite), failed)
    assert len(made) == times
    given = sweep_takes.Subjects(tmp_path / "actors", takes, False)
    given.actor_of(takes[0], TrackConfig(recording="r", overwrite=True), {})
    assert len(made) == times  # those in a folder of the user's own are never made


@dataclass
class Made:
    """What the command needs of an actor."""

    body: Body
    upright_body: Body
    doubtful: tuple[str, ...] = ()


@pytest.fixture
def command(tmp_path, monkeypatch):
    """The command's settings; the making of its actor and the parts of its report are left out."""
    body = load_body(actor_file(tmp_path / "body.yaml"))
    recording = named_recording(tmp_path / "walk")
    report = SimpleNamespace(mean_iou=0.9, warnings=[], notes=[])
    made = lambda request, report: report([Made(body, body)]) or Actors((body,))
    monkeypatch.setattr(actor_command, "new_actors", made)
    monkeypatch.setattr(actor_command, "write_actor_report", lambda *_: report)
    monkeypatch.setattr(actor_command, "say_gains", lambda *_: None)
    return ActorConfig(recording=str(recording), out=str(tmp_path / "actors" / "anna.yaml"))


def test_an_actor_file_is_there_only_with_its_name(command):
    actor_command.run(command, "anna")
    assert load_body(Path(command.out)).name == "anna"


@pytest.mark.parametrize("part", ["write_actor_report", "say_gains"])
def test_an_error_of_the_report_leaves_no_actor_file(command, monkeypatch, part):
    def full(folder, *_):
        assert not Path(command.out).exists()
        raise OSError("the disk is full")

    monkeypatch.setattr(actor_command, part, full)
    with pytest.raises(OSError, match="full"):
        actor_command.run(command, "anna")
    assert not Path(command.out).exists()


def test_a_folder_of_actors_must_have_everybody(tmp_path, made):
    pair = named_recording(tmp_path / "pair", "[anna, ben]")
    (tmp_path / "mine").mkdir()
    actor_file(tmp_path / "mine" / "anna.yaml")
    subjects = sweep_takes.Subjects(tmp_path / "mine", [pair], False)
    with pytest.raises(InputError, match=r"has no ben.yaml.*sogjax actor recording="):
        subjects.actor_of(pair, TrackConfig(recording="r"), {})
    actor_file(tmp_path / "mine" / "ben.yaml")
    files = [str(tmp_path / "mine" / f"{name}.yaml") for name in ("anna", "ben")]
    assert subjects.actor_of(pair, TrackConfig(recording="r"), {}) == files
    assert made == []


def test_example_poses_tell_whom_they_show(tmp_path):
    assert posed_subjects(named_recording(tmp_path / "a")) == ()
    assert posed_subjects(named_recording(tmp_path / "b", poses=True)) == (None,)
    named = named_recording(tmp_path / "c")
    (named / "recording.yaml").write_text(yaml.safe_dump({"example_poses": [{"name": "t", "actor": "ben"}]}))
    assert posed_subjects(named) == ("ben",)


@pytest.mark.parametrize("value", ["[]", "[a, a]", "../a", "3"])
def test_subjects_are_names(tmp_path, value):
    with pytest.raises(InputError, match="subject"):
        sweep_takes.named_subjects(named_recording(tmp_path / "r", value))
