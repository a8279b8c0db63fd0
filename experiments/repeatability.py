"""How much of a result is luck?

    python experiments/repeatability.py recording=FOLDER [actor=actor.yaml] [cameras=[12,6]] [starts=20] [frames=60]
    python experiments/repeatability.py sequences=[walk,talk] [overrides=[images.background=clip]]
    python experiments/repeatability.py 'synth={motion: talk, actors: 2, seed: 3}'

A clip is tracked from many initial poses: the one that is found for it, its root moved by 1 cm and every angle by 2
degrees, drawn anew for each. The table tells the spread (95th percentile minus 5th) of the joints' mean error over the
runs, and in how many a limb was lost: one of its joints was more than 200 mm off for five frames on end. Clips are a
folder, rows of the experiments `sequences` and `together`, or what `sogjax synth` renders. Several actors:
`actor=[a.yaml,b.yaml]`. Writes `repeatability.csv`.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.model.body import Body
from sogjax.quality.metrics import LOST_DISTANCE
from sogjax.run.recordings import file_list
from sogjax.run.terminal import say
from sogjax.settings.compose import track_config
from sogjax.study.experiment import yardsticks
from sogjax.study.repeatability import MM, Outcome, Repeated, outcomes_of, repeated_table, write_repeated
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.source import Source, rendered_source, source_named


@dataclass
class Settings:
    """What is repeated, as `key=value` on the command line."""

    recording: str | None = None
    """A folder with ground truth."""
    sequences: list[str] = field(default_factory=list)
    """Rows of the experiments `sequences` and `together`."""
    synth: dict[str, Any] = field(default_factory=dict)
    """Settings of `sogjax synth`."""
    actor: Any = None
    """A file, or a list of those of several actors; null: made of the example poses with all cameras, and kept."""
    cameras: list[int] = field(default_factory=list)
    """Numbers of cameras, each taken evenly; none: all."""
    starts: int = 20
    frames: int = 60
    """At most, from the first."""
    seed: int = 0
    far: float = LOST_DISTANCE
    """Metres: a joint that is farther off is lost."""
    overrides: list[str] = field(default_factory=list)
    """Of track."""
    out: str = "outputs/repeatability"
    """Where actors, cells and the results are kept."""


def main() -> None:
    """Track, print the table, and write the file."""
    settings = settings_from(Settings)
    if settings.starts < 1:
        raise InputError(f"starts={settings.starts}: give 1 or more")
    found = [
        _repeated(settings, source, count)
        for source in _sources(settings)
        for count in settings.cameras or [len(source.recording.rig.names)]
    ]
    path = Path(settings.out) / "repeatability.csv"
    print(machine_line(), repeated_table(found), sep="\n\n")
    write_repeated(path, found)
    print(f"\n{path}")


def _sources(settings: Settings) -> Iterator[Source]:
    """The clips."""
    if sum(map(bool, (settings.recording, settings.sequences, settings.synth))) != 1:
        raise InputError("give one of recording=FOLDER, sequences=[walk,talk] and 'synth={motion: talk, actors: 2}'")
    folder = Path(settings.out)
    if settings.recording:
        yield source_named(settings.recording, settings.frames, folder)
    for chosen in yardsticks(settings.sequences).values() if settings.sequences else filter(None, [settings.synth]):
        yield rendered_source(chosen, settings.frames, folder)


def _repeated(settings: Settings, source: Source, cameras: int) -> Repeated:
    """The outcomes with so many cameras; each is told as it comes."""
    cache = f"images.cache={json.dumps(str(source.cell_folder))}"
    config = track_config([cache, f"stop={source.num_frames}", *settings.overrides], recording=source.path)
    recording, name = source.seen_by(source.cameras(cameras)), f"{source.name}, {cameras} cameras"
    outcomes: list[Outcome] = []
    for outcome in outcomes_of(
        recording, _actors(settings, source), config, settings.starts, settings.seed, settings.far
    ):
        outcomes.append(outcome)
        lost = f", lost: {', '.join(outcome.lost)}" if outcome.lost else ""
        say(f"{name}, run {len(outcomes)}: {MM * outcome.mean:.1f} mm{lost}")
    return Repeated(name, tuple(outcomes))


def _actors(settings: Settings, source: Source) -> list[Body]:
    """In their own upright frames."""
    return source.actors if settings.actor is None else [load_body(path) for path in file_list(settings.actor)]


if __name__ == "__main__":
    run_script(main)
