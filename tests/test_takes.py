"""Many recordings by one command: which they are, whose actor each has, and what is done again."""

import csv
import json
import shutil
from pathlib import Path

import pytest
import yaml
from command_line import actor_file, refused, trackable
from rendered_person import rendered_person
from small_recording import make_recording

from sogjax.app.cli import main
from sogjax.app.sweep import actors
from sogjax.app.sweep.folders import places_of, recordings_in, root_of, with_folders
from sogjax.app.sweep.takes import is_of_takes
from sogjax.data.actor_file import load_body
from sogjax.data.subject_names import posed_subjects
from sogjax.errors import InputError
from sogjax.settings import TrackConfig

FAST = (
    *("solver.max_iterations=20", "images.depth=6", "outputs.motion_only=true"),
    *("tracking.both_ways=false", "stop=2"),
)


def a_recording(folder, subject=None, poses=False):
    """A recording that is only looked at."""
    make_recording(folder, settings=f"up: z\nsubject: {subject}\n" if subject else "up: z\n")
    if poses:
        (folder / "example_poses" / "tpose").mkdir(parents=True)
    return folder


@pytest.fixture
def lab(tmp_path):
    """Two subjects with two takes each, one of them with a space in its name, and a folder of notes."""
    for name in ("anna/walk", "anna/run fast", "ben/walk"):
        a_recording(tmp_path / "data" / name, name.partition("/")[0])
    (tmp_path / "data" / "anna" / "notes").mkdir()
    (tmp_path / "data" / "anna" / ".hidden").mkdir()
    (tmp_path / "data" / "list.txt").write_text("")
    return tmp_path / "data"


def expanded(pattern):
    return recordings_in(with_folders([f"recording=glob({pattern})"]))


def test_a_pattern_of_folders_is_the_list_of_the_recordings_in_them(lab, capsys):
    assert expanded(f"{lab}/anna/*") == [f"{lab}/anna/run fast", f"{lab}/anna/walk"]
    assert "notes: passed over, as no recording" in capsys.readouterr().err
    assert expanded(f"['{lab}/*/r*','{lab}/b*/*'],exclude={lab}/ben/x*") == [f"{lab}/anna/run fast", f"{lab}/ben/walk"]
    assert expanded(f"'{lab}/[ab]*/r*'") == [f"{lab}/anna/run fast"]
    assert expanded(f"'{lab}/*/*',exclude='{lab}/anna/*'") == [f"{lab}/ben/walk"]


def test_a_pattern_relative_to_the_folder_where_the_command_runs(lab, monkeypatch):
    monkeypatch.chdir(lab)
    assert expanded("*/walk") == ["anna/walk", "ben/walk"]


@pytest.mark.parametrize("words", [("recording=glob({lab}/x*)",), ("recording=glob({lab}/anna/n*)",)])
def test_a_pattern_without_recordings_is_refused(lab, capsys, words):
    assert "a recording has videos/" in refused(capsys, "track", "-m", *(word.format(lab=lab) for word in words))


def test_a_pattern_without_m_is_refused_with_the_remedy(capsys, tmp_path):
    assert "add -m" in refused(capsys, "track", f"recording=glob({tmp_path}/*)")


@pytest.mark.parametrize("word", ["recording=glob(/data/*)", "recording=a,b", "hydra.verbose=true"])
def test_a_command_that_cannot_be_swept_does_not_ask_for_m(capsys, word):
    assert "-m" not in refused(capsys, "check", word)
    assert "add -m" in refused(capsys, "track", word)


@pytest.mark.parametrize(
    ("words", "takes"),
    [
        (["recording=a,b", "stop=3"], True),
        (["recording='a','b c'"], True),
        (["recording=a,b", "stop=3,4"], False),
        (["recording=a", "stop=3,4"], False),
        (["recording=a,b", "hydra/sweeper=optuna"], False),
    ],
)
def test_recordings_alone_are_takes_and_with_other_values_members_of_a_sweep(words, takes):
    assert is_of_takes(words) is takes


def test_a_pattern_that_matches_one_recording_is_no_sweep_over_settings_either():
    assert not is_of_takes(["recording='a'"])
    assert is_of_takes(["recording='a'"], by_pattern=True)
    assert not is_of_takes(["recording='a'", "stop=3,4"], by_pattern=True)


def test_the_place_of_a_take_is_its_path_in_the_folder_of_all(tmp_path):
    paths = [tmp_path / name for name in ("anna/walk", "anna/run", "ben/walk")]
    assert places_of(paths) == ["anna/walk", "anna/run", "ben/walk"]
    assert places_of(paths[:2]) == ["walk", "run"]
    with pytest.raises(InputError, match="twice"):
        places_of([paths[0], paths[0]])
    with pytest.raises(InputError, match="lies in this folder"):
        places_of([tmp_path / "anna", paths[0]])


def test_a_recording_spelled_with_dots_keeps_its_results_in_the_folder_of_all(lab, monkeypatch):
    monkeypatch.chdir(lab / "anna")
    assert places_of([Path("../ben/walk"), Path("walk")]) == ["ben/walk", "anna/walk"]
    with pytest.raises(InputError, match="twice"):
        places_of([Path("../anna/walk"), Path("walk")])
    assert expanded("['walk','../anna/walk',../ben/*]") == ["../anna/walk", "../ben/walk"]


def test_a_recording_that_is_added_moves_no_results_of_a_pattern(lab, tmp_path):
    def places(pattern):
        return places_of(list(map(Path, expanded(pattern))), root_of([f"recording=glob({pattern})"]))

    shutil.rmtree(lab / "ben")
    before = places(f"{lab}/*/*")
    assert before == ["anna/run fast", "anna/walk"]
    a_recording(lab / "ben" / "walk")
    assert places(f"{lab}/*/*") == [*before, "ben/walk"]
    assert places(f"{lab}/anna/*") == ["run fast", "walk"]
    assert places(f"'{lab}/*/[r]*'") == ["anna/run fast"]
    assert places(f"['{lab}/anna/walk','{lab}/ben/*']") == ["anna/walk", "ben/walk"]
    assert root_of([f"recording={lab}/anna/walk,{lab}/anna/run"]) is None


@pytest.mark.parametrize("pattern", [".", "..", "/", "''", "'**/x'", "[]"])
def test_patterns_without_a_name_are_refused_in_a_sentence(capsys, tmp_path, monkeypatch, pattern):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    sentence = refused(capsys, "track", "-m", f"recording=glob({pattern})")
    assert "matches no folder" in sentence or "matches 1 folder, none of them a recording" in sentence


def test_a_pattern_may_be_the_folder_itself_or_begin_at_home(lab, monkeypatch, capsys):
    monkeypatch.chdir(lab / "anna" / "walk")
    assert places_of(list(map(Path, expanded("."))), root_of(["recording=glob(.)"])) == ["walk"]
    monkeypatch.setenv("HOME", str(lab))
    assert expanded("'~/ben/*'") == [f"{lab}/ben/walk"]
    monkeypatch.chdir(lab / "anna")
    assert expanded("'**'") == ["run fast", "walk"]
    told = capsys.readouterr().err
    assert "notes" in told
    assert ": , " not in told


def test_no_recording_lies_among_the_actors(tmp_path):
    with pytest.raises(InputError, match="which is for the actors of all; rename"):
        places_of([tmp_path / "actors", tmp_path / "walk"])
    assert places_of([tmp_path / "actors" / "a", tmp_path / "actors" / "b"]) == ["a", "b"]


@pytest.fixture
def made(monkeypatch):
    """The recordings and names that actors are made of."""
    seen = []

    def run(config):
        seen.append((config.recording.rpartition("/")[2], config.subject))
        if "bad" in config.recording:
            raise InputError("no pose was found")
        actor_file(actors.Path(config.out))

    monkeypatch.setattr(actors.actor_command, "run", run)
    return seen


def test_a_subject_has_one_actor_made_of_the_take_with_example_poses(tmp_path, made):
    takes = [a_recording(tmp_path / name, "anna", poses=name == "poses") for name in ("first", "poses", "last")]
    (tmp_path / "actors").mkdir()
    subjects, config, failed = actors.Subjects(tmp_path / "actors", takes, True), TrackConfig(recording="r"), {}
    files = [subjects.actor_of(take, config, failed) for take in takes]
    assert files == [[str(tmp_path / "actors" / "anna.yaml")]] * 3
    assert made == [("poses", None)]
    assert load_body(tmp_path / "actors" / "anna.yaml").name == "anna"


def test_an_actor_beside_the_videos_goes_first_and_nobody_named_has_none(tmp_path, made):
    own, unnamed = a_recording(tmp_path / "own", "anna"), a_recording(tmp_path / "unnamed")
    actor_file(own / "actor.yaml")
    subjects = actors.Subjects(tmp_path / "actors", [own, unnamed], True)
    assert subjects.actor_of(own, TrackConfig(recording="r"), {}) == [str(own / "actor.yaml")]
    assert subjects.actor_of(unnamed, TrackConfig(recording="r"), {}) is None
    assert made == []


def test_the_next_take_is_tried_where_one_fails_and_the_failure_counts_for_all(tmp_path, made):
    takes = [a_recording(tmp_path / name, "anna", poses=True) for name in ("bad", "good")]
    (tmp_path / "actors").mkdir()
    assert actors.Subjects(tmp_path / "actors", takes, True).actor_of(takes[0], TrackConfig(recording="r"), {})
    assert [name for name, _ in made] == ["bad", "good"]
    alone, failed = a_recording(tmp_path / "bad_ben", "ben"), {}
    subjects = actors.Subjects(tmp_path / "actors", [alone], True)
    for _ in range(2):
        with pytest.raises(InputError, match="no actor of ben: no pose was found"):
            subjects.actor_of(alone, TrackConfig(recording="r"), failed)
    assert [name for name, _ in made] == ["bad", "good", "bad_ben"]


def test_a_folder_of_actors_must_have_everybody(tmp_path, made):
    pair = a_recording(tmp_path / "pair", "[anna, ben]")
    (tmp_path / "mine").mkdir()
    actor_file(tmp_path / "mine" / "anna.yaml")
    subjects = actors.Subjects(tmp_path / "mine", [pair], False)
    with pytest.raises(InputError, match=r"has no ben.yaml.*sogjax actor recording="):
        subjects.actor_of(pair, TrackConfig(recording="r"), {})
    actor_file(tmp_path / "mine" / "ben.yaml")
    files = [str(tmp_path / "mine" / f"{name}.yaml") for name in ("anna", "ben")]
    assert subjects.actor_of(pair, TrackConfig(recording="r"), {}) == files
    assert made == []


def test_example_poses_tell_whom_they_show(tmp_path):
    assert posed_subjects(a_recording(tmp_path / "a")) == ()
    assert posed_subjects(a_recording(tmp_path / "b", poses=True)) == (None,)
    named = a_recording(tmp_path / "c")
    (named / "recording.yaml").write_text(yaml.safe_dump({"example_poses": [{"name": "t", "actor": "ben"}]}))
    assert posed_subjects(named) == ("ben",)


@pytest.mark.parametrize("value", ["[]", "[a, a]", "../a", "3"])
def test_subjects_are_names(tmp_path, value):
    with pytest.raises(InputError, match="subject"):
        actors.named_subjects(a_recording(tmp_path / "r", value))


def rows_of(out):
    with (out / "recordings.csv").open(encoding="utf-8") as file:
        return {row["recording"]: row for row in csv.DictReader(file)}


@pytest.mark.slow
def test_one_fails_the_others_are_done_and_the_command_again_does_what_is_missing(
    capsys, tmp_path, monkeypatch, plain_logging
):
    monkeypatch.chdir(tmp_path)
    data = tmp_path / "my data"
    rendered_person(data / "one", cameras=3, frames=2, width=160, height=120)
    broken = trackable(data / "two")
    (broken / "calibration.toml").write_text("[left]\n")
    words = ("track", "-m", f"recording=glob('{data}/*')", f"actor={actor_file(tmp_path / 'actor.yaml')}", *FAST)

    assert main(words) == 2
    out, err = capsys.readouterr()
    assert err.splitlines()[-1].startswith("sogjax: 1 of 2 recordings failed; the first: ")
    rows = rows_of(tmp_path / "outputs")
    assert "calibration.toml" in rows["two"]["failed"]
    assert rows["two"]["failed"] in out
    assert (rows["one"]["failed"], rows["one"]["frames"]) == ("", "2.0")
    assert float(rows["one"]["seconds"]) > 0.0
    assert float(rows["one"]["mean mm"]) > 0.0  # there is a truth
    assert rows["one"]["verdict"]
    table = (tmp_path / "outputs" / "recordings.md").read_text()
    assert "| two | - |" in table
    motion = tmp_path / "outputs" / "one" / "motion.npz"
    before = motion.stat().st_mtime_ns

    trackable(data / "mended", frames=2)  # nobody is in its pictures, but it can be tracked
    (broken / "calibration.toml").write_text((data / "mended" / "calibration.toml").read_text())
    assert main(words) == 0
    again = rows_of(tmp_path / "outputs")
    assert set(again) == {"one", "two", "mended"}
    assert again["one"] == rows["one"]
    assert again["two"]["failed"] == ""
    assert motion.stat().st_mtime_ns == before
    assert json.loads((tmp_path / "outputs" / "one" / "run.json").read_text())["command"] == "track"
