"""Hydra's launchers, each where it is installed: members in other processes, their results in one table."""

import csv
import os
import subprocess
import sys

import pytest
from command_line import actor_file, trackable

FAST = (
    *("solver.max_iterations=5", "images.depth=6", "outputs.motion_only=true", "tracking.both_ways=false"),
    "images.background=none",
)
LAUNCHERS = {
    "joblib": ("hydra_joblib_launcher", ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]),
    "submitit": (
        "hydra_submitit_launcher",
        ["hydra/launcher=submitit_local", "hydra.launcher.timeout_min=20", "hydra.launcher.cpus_per_task=1"],
    ),
    "ray": ("hydra_ray_launcher", ["hydra/launcher=ray", "+hydra.launcher.ray.init.num_cpus=2"]),
}


@pytest.fixture(params=LAUNCHERS)
def launcher(request):
    """The words that choose a launcher; skipped where its plug-in is not installed."""
    package, words = LAUNCHERS[request.param]
    remedy = f"not installed: pip install 'sogjax[{request.param}]'"
    pytest.importorskip(f"hydra_plugins.{package}", reason=remedy)
    return words


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """Where the processes of all launchers keep compiled programs."""
    return tmp_path_factory.mktemp("programs")


@pytest.fixture
def two(tmp_path):
    """Two recordings, of which one lacks its calibration."""
    trackable(tmp_path / "data" / "whole", frames=2)
    trackable(tmp_path / "data" / "broken", frames=2)
    (tmp_path / "data" / "broken" / "calibration.toml").unlink()
    actor_file(tmp_path / "actor.yaml")
    return tmp_path


def swept(folder, programs, *words):
    """The finished process of a sweep in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "sogjax", "track", "-m", "actor=actor.yaml", *FAST, *words],
        capture_output=True,
        text=True,
        cwd=folder,
        check=False,
        env={**os.environ, "SOGJAX_COMPILATION_CACHE": str(programs)},
    )


def rows_of(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_members_that_work_and_that_fail_are_in_the_table(two, programs, launcher):
    done = swept(two, programs, "recording=data/whole", "stop=2,99", "hydra.sweep.dir=sweep", *launcher)
    assert done.returncode == 2, done.stderr
    worked, failed = rows_of(two / "sweep" / "sweep.csv")
    assert (worked["stop"], worked["failed"]) == ("2", "")
    assert float(worked["iterations"]) > 0.0
    assert "stop=99" in failed["failed"]


@pytest.mark.slow
def test_recordings_that_work_and_that_fail_are_in_the_table(two, programs, launcher):
    done = swept(two, programs, "recording=glob(data/*)", *launcher)
    assert done.returncode == 2, done.stderr
    rows = {row["recording"]: row for row in rows_of(two / "outputs" / "recordings.csv")}
    assert (rows["whole"]["frames"], rows["whole"]["failed"]) == ("2.0", "")
    assert "calibration" in rows["broken"]["failed"]
    assert (two / "outputs" / "whole" / "motion.npz").is_file()
