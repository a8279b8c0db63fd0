"""What do the runs of an experiment, or of a sweep, look like side by side in Rerun?

python experiments/side_by_side.py [experiment=solvers] [recording=walk:0] [frames=40] [to=side_by_side.rrd]
python experiments/side_by_side.py sweep=multirun/DATE recording=FOLDER to=sweep.rrd

Runs of an experiment that were done (in the folder `out`) are read, the others are made; rows that need a recording of
their own, such as one of several people, are left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from sogjax.cli.sweep.results import kept_results
from sogjax.cli.sweep.tables import differing
from sogjax.errors import InputError
from sogjax.io.motion import Motion, load_motion
from sogjax.io.video import read_frames
from sogjax.study.experiment import Experiment
from sogjax.study.runner import motions_of, run_row
from sogjax.study.script import run_script, settings_from
from sogjax.study.settings import USUAL_FRAMES, ReportConfig
from sogjax.study.source import Source
from sogjax.study.study import Study
from sogjax.view.rerun.comparison import write_comparison


def of_experiment(
    study: Study, experiment: Experiment, source: Source
) -> tuple[dict[str, list[Motion]], dict[str, np.ndarray]]:
    """The motions on one recording of every row that tracks it and did not fail, and their errors in metres.

    Raises:
        InputError: there is none.
    """
    motions, errors, failed = {}, {}, "all its rows have recordings of their own"
    for row, entry in experiment.config.rows.items():
        if entry.synth is not None:  # tracked on a recording of its own
            continue
        record = run_row(experiment, row, source, study.runs, study.overrides)
        if record is None or record.failed:
            failed = record.failed if record else failed
            continue
        motions[row] = list(motions_of(record, source.bodies, source.recording.fps).values())
        errors[row] = 1e-3 * record.errors
    if not motions:
        raise InputError(
            f"experiment={experiment.name}: no row worked on {source.name} ({failed}); choose another recording or "
            "experiment"
        )
    return motions, errors


@dataclass
class Settings:
    """What is shown, as `key=value` on the command line."""

    experiment: str = "solvers"
    sweep: str = ""
    """Folder of a sweep, whose members are shown instead."""
    recording: str = ReportConfig().recordings[0]
    frames: int = USUAL_FRAMES
    out: str = ReportConfig().out
    to: str = "side_by_side.rrd"


def main() -> None:
    """Write the file."""
    settings = settings_from(Settings)
    study = Study(Path(settings.out), [settings.recording], settings.frames)
    source = study.source(settings.recording)
    errors: dict[str, np.ndarray] = {}
    if settings.sweep:
        runs: Mapping[str, list[Motion]] = of_sweep(Path(settings.sweep))
    else:
        runs, errors = of_experiment(study, Experiment.named(settings.experiment), source)
    count = max(int(motion.frame[-1]) for motions in runs.values() for motion in motions) + 1
    pictures = read_frames(source.recording, 0, count - source.recording.first_frame)
    truth = None if source.recording.ground_truth is None else source.truth
    write_comparison(Path(settings.to), source.recording, runs, errors=errors, frames=pictures, truth=truth)
    print(settings.to)


def of_sweep(folder: Path) -> dict[str, list[Motion]]:
    """The motions of every member that did not fail.

    Raises:
        InputError: there is none.
    """
    members = kept_results(folder)
    names = differing([member.overrides for member in members])
    paths = sorted(folder.glob("*/result.json"), key=lambda path: (len(path.parent.name), path.parent.name))
    folders = [path.parent for path in paths]
    runs = {
        name: [load_motion(path) for path in sorted(place.glob("motion*.npz"))]
        for name, place, member in zip(names, folders, members, strict=True)
        if not isinstance(member.result, str)
    }
    if not runs:
        raise InputError(f"{folder}: holds no member of a sweep that worked; give the folder that a sweep printed")
    return runs


if __name__ == "__main__":
    run_script(main)
