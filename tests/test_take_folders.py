"""Which recordings a command names, and where the results of each lie."""

import shutil
from pathlib import Path

import pytest
from command_line import refused
from small_recording import named_recording

from sogjax.cli.sweep.folders import places_of, recordings_in, with_folders
from sogjax.cli.sweep.takes import is_of_takes
from sogjax.errors import InputError


@pytest.fixture
def lab(tmp_path):
    """Two subjects with two takes each, one of them with a space in its name, and a folder of notes."""
    for name in ("anna/walk", "anna/run fast", "ben/walk"):
        named_recording(tmp_path / "data" / name, name.partition("/")[0])
    (tmp_path / "data" / "anna" / "notes").mkdir()
    (tmp_path / "data" / "anna" / ".hidden").mkdir()
    (tmp_path / "data" / "list.txt").write_text("")
    return tmp_path / "data"


def expanded(pattern):
    return recordings_in(with_folders([f"recording=glob({pattern})"])[0])


def root_of(word):
    return with_folders([word])[1]


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
        return places_of(list(map(Path, expanded(pattern))), root_of(f"recording=glob({pattern})"))

    shutil.rmtree(lab / "ben")
    before = places(f"{lab}/*/*")
    assert before == ["anna/run fast", "anna/walk"]
    named_recording(lab / "ben" / "walk")
    assert places(f"{lab}/*/*") == [*before, "ben/walk"]
    assert places(f"{lab}/anna/*") == ["run fast", "walk"]
    assert places(f"'{lab}/*/[r]*'") == ["anna/run fast"]
    assert places(f"['{lab}/anna/walk','{lab}/ben/*']") == ["anna/walk", "ben/walk"]
    assert root_of(f"recording={lab}/anna/walk,{lab}/anna/run") is None


@pytest.mark.parametrize("pattern", [".", "..", "/", "''", "'**/x'", "[]"])
def test_patterns_without_a_name_are_refused_in_a_sentence(capsys, tmp_path, monkeypatch, pattern):
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    sentence = refused(capsys, "track", "-m", f"recording=glob({pattern})")
    assert "matches no folder" in sentence or "matches 1 folder, none of them a recording" in sentence


def test_a_pattern_may_be_the_folder_itself_or_begin_at_home(lab, monkeypatch, capsys):
    monkeypatch.chdir(lab / "anna" / "walk")
    assert places_of(list(map(Path, expanded("."))), root_of("recording=glob(.)")) == ["walk"]
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
