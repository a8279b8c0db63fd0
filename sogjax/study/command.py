"""What the scripts in `experiments/` share: one experiment of `conf/experiment/` from the command line."""

from dataclasses import dataclass, field
from pathlib import Path

from sogjax.study.experiment import Experiment
from sogjax.study.machine import machine_line
from sogjax.study.script import run_script, settings_from
from sogjax.study.settings import ReportConfig
from sogjax.study.study import Study
from sogjax.study.table import findings, markdown_table, recordings_table


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recordings: list[str] = field(default_factory=lambda: ReportConfig().recordings)
    """Folders with ground truth, or MOTION:SEED of rendered ones."""
    frames: int = ReportConfig().frames
    out: str = ReportConfig().out
    """Where runs are kept; a run that is there is not done again."""
    body: str = ReportConfig().body
    """That actors are made from."""
    overrides: list[str] = field(default_factory=list)
    """Of the track config, for all rows."""


def study_main(name: str) -> None:
    """Do the runs of an experiment that are not there yet, and print its tables."""
    run_script(lambda: _print_tables(name, settings_from(Settings)))


def _print_tables(name: str, settings: Settings) -> None:
    experiment = Experiment.named(name)
    study = Study(Path(settings.out), settings.recordings, settings.frames, settings.overrides, body=settings.body)
    rows = [row for row in study.summary(experiment) if row.by_recording or row.failed]
    print(machine_line())
    print(f"\n{experiment.config.title}: {experiment.config.question}\n")
    print(markdown_table(experiment, rows), recordings_table(experiment, rows), sep="\n\n", end="\n\n")
    print(*findings(experiment, rows), sep="\n")
