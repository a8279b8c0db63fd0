"""How many degrees are joint angles off, by joint and plane?

    python experiments/degrees.py runs=[RUN,RUN,...] [truths=[FILE,FILE,...]]

Runs are folders of results, of rendered recordings or others with a truth; those with the same number of cameras make
one table. Where a truth has no joint angles (rendered by earlier versions, or labelled by hand), the angles between the
lines that join its joints are compared. `truths` are other files of the runs' truths, one for each.
"""

from dataclasses import dataclass, field

from sogjax.errors import InputError
from sogjax.study.degrees import angles_of_run, degrees_tables, truths_of
from sogjax.study.script import run_script, settings_from


@dataclass
class Settings:
    """What is compared, as `key=value` on the command line."""

    runs: list[str] = field(default_factory=list)
    """Folders of results."""
    truths: list[str] = field(default_factory=list)
    """Files of truth, one for each run; none: those of the recordings."""


def main() -> None:
    """Compare, and print the tables."""
    settings = settings_from(Settings)
    if not settings.runs:
        raise InputError("runs=[]: nothing to compare; give folders of results, runs=[RUN,RUN]")
    pairs = truths_of(settings.runs, settings.truths).items()
    print(degrees_tables([angles_of_run(run, truth) for run, truth in pairs]))


if __name__ == "__main__":
    run_script(main)
