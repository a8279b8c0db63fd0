"""What is the answer to one of the study's questions?

python experiments/study.py NAME [recordings=[walk:0,FOLDER]] [frames=60] [out=FOLDER] [overrides=[KEY=VALUE]]

Does the runs of `conf/experiment/NAME.yaml`, or of a file like those, that are not there yet, and prints the
tables.
"""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from sogjax.errors import InputError
from sogjax.study.experiment import Experiment, experiment_names
from sogjax.study.methods import comparison_table
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.settings import ReportConfig
from sogjax.study.study import Study
from sogjax.study.table import findings, markdown_table, recordings_table


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recordings: list[str] = field(default_factory=lambda: ReportConfig().recordings)
    """Folders with ground truth, or MOTION:SEED of rendered ones."""
    frames: int | None = None
    """At most; null: as many as the experiment asks for, or 40."""
    out: str = ReportConfig().out
    """Where runs are kept; a run that is there is not done again."""
    body: str = ReportConfig().body
    """That actors are made from."""
    overrides: list[str] = field(default_factory=list)
    """Of the track config, for all rows."""


def _experiment_and_settings(words: Sequence[str]) -> tuple[Experiment, Settings]:
    names = [word for word in words if "=" not in word]
    if len(names) != 1:
        given = " and ".join(names) if names else "no experiment"
        raise InputError(f"{given}: name one experiment: {', '.join(experiment_names())}")
    return Experiment.named(names[0]), settings_from(Settings, [word for word in words if "=" in word])


def _print_tables(experiment: Experiment, settings: Settings) -> None:
    study = Study(Path(settings.out), settings.recordings, settings.frames, settings.overrides, body=settings.body)
    rows = {method: study.summary(experiment, method) for method in experiment.methods}
    print(machine_line())
    print(f"\n{experiment.config.title}: {experiment.config.question}\n")
    if experiment.config.methods:
        print(comparison_table(experiment, rows), end="\n\n")
    for method, of_method in rows.items():
        print(*([f"{method}:"] if method else []), markdown_table(experiment, of_method), sep="\n\n", end="\n\n")
        recordings = [] if experiment.config.reference is None else [recordings_table(experiment, of_method)]
        failed = [f"failed, {row.name}: {reason}" for row in of_method for reason in row.failed]
        print(*recordings, *findings(experiment, of_method), *failed, sep="\n", end="\n\n")


if __name__ == "__main__":
    run_script(lambda: _print_tables(*_experiment_and_settings(sys.argv[1:])))
