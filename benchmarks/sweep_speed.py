"""How many single runs does a sweep of settings take by the clock, and what does a later member cost beyond tracking?

    python benchmarks/sweep_speed.py [settings=15] [frames=40] [workers=2] [launcher=joblib] [overrides=[...]]

Both are processes of their own on the demo's recording with its actor: `sogjax track`, and `sogjax track -m` over as
many values of `energy.limit_weight`; each with an empty folder for compiled programs, and with what the first run kept.
With `workers`, the sweep is run by so many processes as well, with a folder of its own; `submitit_local` takes as many
as there are settings, and `ray` needs them as cores.
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
from quantities import Quantity
from start_up import OURS, cpu_seconds, made_actor
from track_speed import demo_recording

from sogjax.errors import counted
from sogjax.run.clock import TOTAL, TRACKING
from sogjax.study.script import machine_line, run_script, settings_from

LAUNCHERS = {
    "joblib": ["hydra/launcher=joblib", "hydra.launcher.n_jobs={workers}"],
    "submitit_local": ["hydra/launcher=submitit_local", "hydra.launcher.timeout_min=20"],
    "ray": ["hydra/launcher=ray", "+hydra.launcher.ray.init.num_cpus={workers}"],
}
"""Words that share a sweep out."""
AIM = 4.0
"""Single runs that a sweep of 15 settings may take."""


@dataclass
class Settings:
    """What is measured, as `key=value` on the command line."""

    settings: int = 15
    frames: int = 40
    workers: int = 1
    launcher: str = "joblib"
    overrides: list[str] = field(default_factory=list)


class Taken(NamedTuple):
    """Seconds by the clock."""

    run: float
    sweep: float
    member: float
    """A later member, the median."""
    tracking: float
    """Of which its frames after the first one."""
    cpus: float
    """CPU seconds of the sweep."""
    programs: int
    """Kept after it."""


def main() -> None:
    """Print two rows."""
    settings, recording = settings_from(Settings), demo_recording()
    print(machine_line())
    with TemporaryDirectory() as folder:
        actor = made_actor(recording, Path(folder), OURS)
        for workers in sorted({1, settings.workers}):
            print(f"{counted(workers, 'process', 'processes')}:")
            for name, taken in measured(recording, actor, replace(settings, workers=workers)):
                print(
                    f"programs {name}: run {taken.run:.1f} s, sweep of {settings.settings} {taken.sweep:.1f} s "
                    f"(CPU {taken.cpus:.1f}), {taken.sweep / taken.run:.1f} runs; a later member {taken.member:.2f} s, "
                    f"of which tracking {taken.tracking:.2f} s; {taken.programs} programs kept",
                    flush=True,
                )


def sweep_quantities(actor: Path, frames: int) -> Iterator[Quantity]:
    """The rows of the report."""
    for name, taken in measured(demo_recording(), actor, Settings(frames=frames)):
        aim = AIM if name == "cold" else None
        yield Quantity("sweep", f"15 settings in single runs, {name}", taken.sweep / taken.run, "ratio", target=aim)
        yield Quantity("sweep", f"a later member over its tracking, {name}", taken.member / taken.tracking, "ratio")


def measured(recording: Path, actor: Path, settings: Settings) -> Iterator[tuple[str, Taken]]:
    """With programs compiled anew, and kept."""
    words = [f"recording={recording}", f"actor={actor}", f"stop={settings.frames}", *settings.overrides]
    values = ",".join(f"{weight:.3f}" for weight in np.linspace(0.5, 2.0, settings.settings))
    launcher = [] if settings.workers == 1 else LAUNCHERS[settings.launcher]
    shared_out = [word.format(workers=settings.workers) for word in launcher]
    swept = [*words, "-m", f"energy.limit_weight={values}", *shared_out]
    with TemporaryDirectory() as folder:
        for name in ("cold", "kept"):
            out = Path(folder) / name
            programs = Path(folder) / "programs_of_sweeps"
            run = _seconds([*words, f"out={out / 'run'}"], Path(folder) / "programs_of_runs", out)
            before = cpu_seconds()
            sweep = _seconds([*swept, f"hydra.sweep.dir={out / 'sweep'}"], programs, out)
            cpus, kept = cpu_seconds() - before, sum(1 for _ in programs.rglob("*-cache"))
            notes = [json.loads(path.read_text())["seconds"] for path in (out / "sweep").glob("*/run.json")]
            later = sorted(notes, key=lambda note: note[TOTAL])[:-1]
            yield name, Taken(run, sweep, _median(later, TOTAL), _median(later, TRACKING), cpus, kept)


def _median(notes: Sequence[dict[str, float]], stage: str) -> float:
    return float(np.median([note[stage] for note in notes]))


def _seconds(words: Sequence[str], programs: Path, folder: Path) -> float:
    """Of `sogjax track` in a folder, by the clock."""
    folder.mkdir(parents=True, exist_ok=True)
    begin = time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "sogjax", "track", *words],
        check=True,
        capture_output=True,
        cwd=folder,
        env=os.environ | {"SOGJAX_COMPILATION_CACHE": str(programs)},
    )
    return time.perf_counter() - begin


if __name__ == "__main__":
    run_script(main)
