"""`sogjax track -m ... sweep=vmapped`: the files and the table of the ordinary sweep, from one compiled call."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from command_line import actor_file, done, refused, trackable
from rendered_person import rendered_person

from sogjax.app import grid
from sogjax.app.cli import main
from sogjax.app.composition import sweep_folder
from sogjax.data.motion import load_motion
from sogjax.errors import InputError

LIGHT = ("outputs.overlay=false", "outputs.rerun_images=false", "solver.max_iterations=12", "images.depth=5")
SWEEP = ("energy.limit_weight=0,1", "solver.epsilon=0.002,0.02")


@pytest.fixture(autouse=True)
def new_folder(tmp_path, monkeypatch, plain_logging):
    """Results go to a new folder."""
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def recording(tmp_path):
    """A rendered person, three cameras, three frames; its rough pose has the landmarks of the small actor."""
    folder = tmp_path / "person"
    return rendered_person(folder, cameras=3, frames=3, width=96, height=72)


def rows_of(table):
    """Settings and numbers of a sweep's table, without the last column, which is a rate."""
    lines = [line.split() for line in table.splitlines() if line.startswith("energy.limit_weight=")]
    return [(line[:2], [float(value) for value in line[2:-1]]) for line in lines]


def files_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*.*") if path.name != "multirun.yaml")


def test_one_call_leaves_what_the_ordinary_sweep_leaves(capsys, tmp_path, recording):
    words = (f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *LIGHT, *SWEEP)
    ordinary, _ = done(capsys, "track", "-m", *words)
    Path("multirun").rename("ordinary")
    once, _ = done(capsys, "track", "-m", *words, "sweep=vmapped")
    (before,), (after,) = Path("ordinary").iterdir(), Path("multirun").iterdir()
    expected = [name for name in files_in(before) if not name.endswith(".log")]
    assert files_in(after) == expected
    assert {f"{k}/{name}" for k in range(4) for name in ("motion.npz", "metrics.json", "motion.rrd")} < set(expected)
    for k in range(4):
        one, other = load_motion(before / str(k) / "motion.npz"), load_motion(after / str(k) / "motion.npz")
        np.testing.assert_allclose(other.pose, one.pose, atol=2e-3)
        np.testing.assert_allclose(other.energy, one.energy, rtol=1e-3)
        np.testing.assert_array_equal(other.frame, one.frame)
        configs = [yaml.safe_load((folder / str(k) / "config.yaml").read_text()) for folder in (before, after)]
        assert [config.pop("sweep") for config in configs] == ["each", "vmapped"]
        outs = [config.pop("out") for config in configs]
        assert configs[0] == configs[1]
        assert all(out.endswith(f"/{k}") for out in outs)
    assert len(rows_of(once)) == 4
    for (names, numbers), (same_names, same_numbers) in zip(rows_of(once), rows_of(ordinary), strict=True):
        assert names == same_names
        np.testing.assert_allclose(numbers, same_numbers, rtol=0.02, atol=0.5)


@pytest.mark.parametrize(
    ("override", "key"),
    [
        ("images.depth=4,5", "images.depth=4,5"),
        ("start=0,1", "start=0,1"),
        ("outputs.bvh=true,false", "outputs.bvh=True,False"),
        ("energy.capped=true,false", "energy.capped=True,False"),
        ("solver.method=lbfgs,conditioned_ascent", "solver.method=lbfgs,conditioned_ascent"),
        ("color.space=rgb,lab", "color.space=rgb,lab"),
        ("energy.pairs=sparse,dense", "energy.pairs=sparse,dense"),
    ],
)
def test_what_is_no_number_of_one_program_is_refused(capsys, tmp_path, override, key):
    words = (f"recording={trackable(tmp_path / 'walk')}", f"actor={actor_file(tmp_path / 'a.yaml')}", *LIGHT)
    sentence = refused(capsys, "track", "-m", *words, "energy.limit_weight=1,2", override, "sweep=vmapped")
    assert f"{key}: cannot differ within one compiled call" in sentence
    assert not (tmp_path / "multirun").exists()


def test_hydras_own_settings_and_unknown_ways_are_refused(capsys, tmp_path):
    words = ("track", "-m", f"recording={tmp_path}", "energy.limit_weight=1,2")
    for word in ("hydra.sweep.subdir=x", "hydra/launcher=joblib", "+hydra.sweep.dir=x"):
        assert "Hydra's own settings" in refused(capsys, *words, "sweep=vmapped", word)
    assert "write key=value" in refused(capsys, *words, "sweep=vmapped", "hydra.sweep.dir=x", "start=[")
    assert "each, vmapped" in refused(capsys, "track", f"recording={trackable(tmp_path / 'walk')}", "sweep=batched")


def test_a_member_that_fails_is_a_row_and_the_others_go_on(capsys, tmp_path, recording, monkeypatch):
    write = grid.write_results

    def fails_for_the_first(run, out, *rest):
        if out.name == "0":
            raise InputError("the disk is full")
        write(run, out, *rest)

    monkeypatch.setattr(grid, "write_results", fails_for_the_first)
    words = (f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *LIGHT, "outputs.rerun=false")
    assert main(["track", "-m", *words, "energy.limit_weight=0,1", "sweep=vmapped"]) == 2
    first, second = (line for line in capsys.readouterr().out.splitlines() if line.startswith("energy.limit_weight="))
    assert "failed: the disk is full" in first
    assert "failed" not in second
    assert load_motion(next(Path("multirun").iterdir()) / "1" / "motion.npz").num_frames == 3


def test_the_folder_can_be_chosen_and_is_not_overwritten_unasked(capsys, tmp_path, recording):
    folder = tmp_path / "my sweeps" / "first"
    light = ("outputs.rerun=false", "energy.limit_weight=0,1", "sweep=vmapped", f"hydra.sweep.dir={folder}")
    words = ("track", "-m", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *LIGHT, *light)
    done(capsys, *words)
    assert not Path("multirun").exists()
    before = {name: (folder / name).read_bytes() for name in files_in(folder)}
    assert {"sweep.csv", "0/motion.npz", "1/run.json"} <= set(before)
    assert f"{folder}/0: holds the results of an earlier run" in refused(capsys, *words)
    assert {name: (folder / name).read_bytes() for name in files_in(folder)} == before
    done(capsys, *words, "overwrite=true", "outputs.bvh=false")
    left = {name for name in before if not name.endswith(".bvh")}
    assert set(files_in(folder)) == left


def test_the_folder_is_the_one_of_the_ordinary_sweep():
    assert sweep_folder("track", []).parent == Path("multirun")
    assert sweep_folder("track", ["hydra.sweep.dir=a/${now:%Y}"]).parent == Path("a")
    with pytest.raises(InputError, match="key=value"):
        sweep_folder("track", ["hydra.sweep.dir=a{"])
