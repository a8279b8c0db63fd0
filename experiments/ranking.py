"""Is what was lost the objective's fault, or the search's?

    python experiments/ranking.py recording=FOLDER motion=motion.npz [actor=actor.yaml] [every=5] [SET ...]

From the tracked pose of every frame and from the true one (the actor's own skeleton, fitted to the truth) the tracker's
solver climbs to an optimum, and the two are compared. Where a limb was lost, either the wrong pose is worth more, so
no search can help, or the true one is, and was not reached. So the truth is an oracle: one more hypothesis beside the
tracked pose, and a table tells in what share of the frames the tracker's energy chooses it, and by how much. `every=5`
looks at every fifth frame. A SET is what `sogjax track` takes, in one word:

    python experiments/ranking.py recording=R motion=M default "preset=paper energy.limit_weight=2"

Several actors: `motion=[a.npz,b.npz]`. Writes `OUT.csv` and `OUT.png`.
"""

import json
import sys
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from omegaconf import MISSING

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.files import write_file
from sogjax.io.motion import load_motion
from sogjax.model.body import Body
from sogjax.run.recordings import file_list, opened
from sogjax.run.terminal import say
from sogjax.study.ranking import (
    RankedTrack,
    curves_of,
    limbs_table,
    oracle_table,
    ranking_of,
    terms_table,
    verdicts_table,
    write_csv,
)
from sogjax.study.script import HELP, machine_line, run_script, settings_from
from sogjax.view.charts import ranking_chart


@dataclass
class Settings:
    """What is compared, as `key=value` on the command line."""

    recording: str = MISSING
    motion: Any = MISSING
    """A file, or a list of those of several actors."""
    actor: Any = None
    """Theirs; null: beside the motions."""
    out: str = "ranking"
    far: float = 0.1
    """Metres: a limb that is farther off is lost."""
    every: int = 1
    """Of how many frames one is looked at."""
    sets: list[str] = field(default_factory=lambda: ["default"])


def main() -> None:
    """Print the tables, and write the files."""
    settings = settings_from(Settings, _with_sets(sys.argv[1:]))
    if settings.every < 1:
        raise InputError(f"every={settings.every}: give 1 or more")
    motions = [load_motion(path) for path in file_list(settings.motion)]
    recording = opened(settings.recording)
    track = RankedTrack.of(recording, motions, [*_actors(settings)])
    rankings = []
    for words in settings.sets:
        say(f"{words}: climbing in {len(track.frames[:: settings.every])} frames")
        rankings.append(ranking_of(track, words, settings.far, settings.every))
    tables = (oracle_table, verdicts_table, limbs_table, terms_table)
    print(machine_line(), *(table(rankings) for table in tables), sep="\n\n")
    write_csv(Path(f"{settings.out}.csv"), rankings)
    write_file(Path(f"{settings.out}.png"), ranking_chart([curves_of(ranking) for ranking in rankings]))
    print(f"\n{settings.out}.csv\n{settings.out}.png")


def _actors(settings: Settings) -> list[Body]:
    """The actors of the motions: their files, else those that the run wrote beside the motions."""
    if settings.actor is not None:
        return [load_body(path) for path in file_list(settings.actor)]
    motions = file_list(settings.motion)
    return [load_body(path.with_name(path.stem.replace("motion", "actor", 1) + ".yaml")) for path in motions]


def _with_sets(words: list[str]) -> list[str]:
    """The words of a command line, where those that are no setting of the script are its sets."""
    known = {entry.name for entry in fields(Settings)}
    own = [word for word in words if word in HELP or (" " not in word and word.partition("=")[0] in known)]
    sets = [word for word in words if word not in own]
    return [*own, f"sets={json.dumps(sets)}"] if sets else own


if __name__ == "__main__":
    run_script(main)
