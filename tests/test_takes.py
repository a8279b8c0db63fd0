"""Many recordings by one command: what is done, what fails, and what is done again."""

import csv
import json
import os

import pytest
from command_line import actor_file, refused, trackable
from rendered_person import rendered_person

from sogjax.cli.main import main
from sogjax.cli.sweep import takes
from sogjax.cli.sweep.results import NO_RESULT, Member, keep_row, row_of
from sogjax.run.run_folder import write_note

FAST = (
    *("solver.max_iterations=20", "images.depth=6", "outputs.motion_only=true"),
    *("tracking.both_ways=false", "stop=2"),
)
FEWEST = (
    *("solver.max_iterations=3", "solver.min_iterations=1", "images.depth=4", "images.background=none"),
    *("outputs.motion_only=true", "tracking.both_ways=false"),
)


def rows_of(out):
    with (out / "recordings.csv").open(encoding="utf-8") as file:
        return {row["recording"]: row for row in csv.DictReader(file)}


@pytest.fixture
def pair(tmp_path, monkeypatch, plain_logging):
    """The words that track two recordings in which nobody is to be seen."""
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b"):
        trackable(tmp_path / name, frames=2)
    return ("track", "-m", "recording=a,b", f"actor={actor_file(tmp_path / 'actor.yaml')}", *FEWEST)


@pytest.mark.slow
def test_a_refused_command_keeps_the_rows_of_what_has_ended(capsys, tmp_path, pair):
    assert main(pair) == 0
    rows, results = rows_of(tmp_path / "outputs"), tmp_path / "outputs" / "a" / "result.json"
    assert rows["a"]["verdict"] not in ("", "-")
    kept = results.read_text()
    capsys.readouterr()

    assert main([*pair, "energy.limit_weight=0.5"]) == 2
    refusal = capsys.readouterr().err.splitlines()[-1]
    for word in ("2 of 2", "energy.limit_weight was", "now it is 0.5", "out=", "overwrite=true"):
        assert word in refusal
    assert "resume=true" not in refusal
    assert "cannot be resumed" in rows_of(tmp_path / "outputs")["b"]["failed"]
    assert results.read_text() == kept

    results.unlink()  # as if the command had been killed before it was kept
    assert main(pair) == 0
    assert rows_of(tmp_path / "outputs") == rows


@pytest.mark.slow
def test_what_kept_a_recording_from_any_result_is_told(capsys, pair):
    assert main([*pair[:2], "recording=glob(a)", *pair[3:]]) == 0
    capsys.readouterr()
    assert main([*pair, "hydra.launcher.n_jbos=2"]) == 2
    assert "n_jbos" in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.slow
def test_any_error_before_tracking_is_a_row(capsys, tmp_path, pair, monkeypatch):
    whole = takes.Subjects.actor_of

    def actor_of(self, take, *arguments):
        if take.name == "a":
            raise ArithmeticError("no such inverse")
        return whole(self, take, *arguments)

    (tmp_path / "actors").mkdir()
    actor_file(tmp_path / "actors" / "ben.yaml")
    (tmp_path / "b" / "recording.yaml").write_text("up: z\nsubject: ben\n")
    monkeypatch.setattr(takes.Subjects, "actor_of", actor_of)
    assert main([*pair[:3], "actor=actors", *FEWEST]) == 2
    rows = rows_of(tmp_path / "outputs")
    assert "ArithmeticError: no such inverse" in rows["a"]["failed"]
    assert (rows["b"]["failed"], rows["b"]["frames"]) == ("", "2.0")


@pytest.mark.parametrize("word", ["hydra.sweep.dir=elsewhere", "hydra.sweep.subdir=x"])
def test_a_folder_of_hydras_is_refused_with_the_remedy(capsys, pair, word):
    assert "use out=DIR instead" in refused(capsys, *pair, word)


def test_a_row_that_is_older_than_the_run_is_not_of_it(tmp_path):
    keep_row(tmp_path, Member([], {"frames": 3.0, "verdict": "looks right"}))
    assert row_of("a", tmp_path).failed == NO_RESULT
    write_note(tmp_path / "run.json", {"command": "track"})
    os.utime(tmp_path / "run.json", ns=(0, 0))
    assert row_of("a", tmp_path).sentence == "looks right"
    os.utime(tmp_path / "result.json", ns=(-1, -1))
    assert row_of("a", tmp_path).failed == NO_RESULT


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
