"""Which solver is the most accurate for its time, with all pairs of blobs or with near ones only?

python experiments/solvers.py [recordings=[FOLDER,...]] [motions=[walk]] [solvers=[conditioned_ascent,...]] [frames=60]
    [pairs=[dense,sparse]] [overrides=[tracking.extrapolation=0.5,...]]

`recordings` are folders with ground truth; `motions` are rendered with the demo's settings, or taken from the cache.
A recording's actor is made once for all of its rows. `ms` is the least and the median time of a tracking step, without
decoding; on a machine that does other things too, the least time is what compares.
"""

import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sogjax.app.progress import progress
from sogjax.app.script import machine_line, run_script, settings_from, track_folder
from sogjax.app.sweep import row_numbers
from sogjax.app.track import Run
from sogjax.data.recording import open_recording
from sogjax.synth import SynthSettings, cached_recording

HEAD = "{:<16}{:<20}{:<8}{:>9}{:>9}{:>7}{:>12}{:>15}{:>9}{:>9}"
ROW = "{:<16}{:<20}{:<8}{:>9.1f}{:>9.1f}{:>7.0f}{:>12.1f}{:>15.0f}{:>9.1f}{:>9.1f}"


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recordings: list[str] = field(default_factory=list)
    motions: list[str] = field(default_factory=lambda: ["walk"])
    solvers: list[str] = field(default_factory=lambda: ["conditioned_ascent", "lbfgs", "gauss_newton"])
    pairs: list[str] = field(default_factory=lambda: ["dense", "sparse"])
    frames: int = 60
    overrides: list[str] = field(default_factory=list)


def main() -> None:
    """Print a row for every recording, solver and choice of pairs, then all of them as a table."""
    settings = settings_from(Settings)
    rendered = [SynthSettings(motion, frames=settings.frames) for motion in settings.motions]
    folders = [*map(Path, settings.recordings), *(cached_recording(s, progress=progress) for s in rendered)]
    rows = []
    for folder in folders:
        frames = min(settings.frames, open_recording(folder).num_frames)
        for solver in settings.solvers:
            for pairs in settings.pairs:
                words = [f"solver={solver}", f"energy.pairs={pairs}", f"stop={frames}", *settings.overrides]
                rows.append(row(folder.name, solver, pairs, track_folder(folder, words)))
                print(rows[-1], file=sys.stderr)
    print(machine_line(), end="\n\n")
    titles = ("mean mm", "std mm", "lost", "iterations", "not converged", "least ms", "median")
    print(HEAD.format("recording", "solver", "pairs", *titles))
    print("\n".join(rows))


def row(name: str, solver: str, pairs: str, result: Run) -> str:
    """One line of the table."""
    numbers = row_numbers(result)
    milliseconds = 1000.0 * np.array(result.times.seconds["step"][1:])
    return ROW.format(
        name[:15],
        solver,
        pairs,
        numbers["mean mm"],
        numbers["std mm"],
        numbers["lost"],
        numbers["iterations"],
        numbers["not converged"],
        milliseconds.min(initial=np.inf),
        float(np.median(milliseconds)) if len(milliseconds) else np.nan,
    )


if __name__ == "__main__":
    run_script(main)
