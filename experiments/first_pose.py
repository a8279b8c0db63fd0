"""Is an initial pose that is called sure right?

    python experiments/first_pose.py [limit=200] [minutes=60] [out=outputs/first_pose] [sequences=[walk,hug]]

Frames of the yardstick sequences are drawn at random, with 3 to 12 cameras, with plates and without, and searched
without a hint. A pose is right if its joints are within 10 cm of the truth on average, left and right are not
exchanged, and it is not taken back to front. Searches that were made are kept, and not made again by the same program.
Writes `searches.csv` and `reliability.png`.
"""

import time
from dataclasses import dataclass, field
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.files import write_file
from sogjax.run.terminal import say
from sogjax.study.experiment import yardsticks
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.search_tables import kinds_line, reliability, sure_table, write_searches, wrong_table
from sogjax.study.searches import Search, Searches, drawn_trials
from sogjax.study.study import Study
from sogjax.view.charts import reliability_chart


@dataclass
class Settings:
    """What is searched, as `key=value` on the command line."""

    limit: int = 200
    """Searches, of all that are drawn."""
    minutes: float = 0.0
    """After which no further search is begun; 0: no bound."""
    sequences: list[str] = field(default_factory=list)
    """Rows of the experiment; none: all."""
    cameras: list[int] = field(default_factory=lambda: list(range(3, 13)))
    frames: int = 60
    """Of each recording, of which one is drawn."""
    seed: int = 0
    """From which searches are drawn."""
    body: str = "human"
    overrides: list[str] = field(default_factory=list)
    """Of track."""
    out: str = "outputs/first_pose"
    """Where searches, actors and results are kept."""


def main() -> None:
    """Search, print the tables, and write the files."""
    settings = settings_from(Settings)
    out = Path(settings.out)
    searches = [*_searched(settings, out)]
    if not searches:
        raise InputError(f"minutes={settings.minutes:g}: no search was made; give more time")
    print(machine_line(), sure_table(searches), kinds_line(searches), wrong_table(searches), sep="\n\n")
    write_searches(out / "searches.csv", searches)
    write_file(out / "reliability.png", reliability_chart(reliability(searches)))
    print(f"\n{out / 'searches.csv'}\n{out / 'reliability.png'}")


def _searched(settings: Settings, out: Path) -> list[Search]:
    """The searches that were made before or can be made in the time."""
    study = Study(out, ["walk:0"], settings.frames, body=settings.body)
    folder = Searches(study, settings.overrides)
    begin, found = time.perf_counter(), []
    trials = drawn_trials(
        yardsticks(settings.sequences), settings.cameras, settings.frames, settings.limit, settings.seed
    )
    for trial in trials:
        late = settings.minutes > 0.0 and time.perf_counter() - begin > 60.0 * settings.minutes
        found += folder.of(trial, do=not late)
    if len({search.trial.number for search in found}) < settings.limit:
        say(f"{len({search.trial.number for search in found})} of {settings.limit} searches are done")
    return found


if __name__ == "__main__":
    run_script(main)
