"""Are two people who pass each other closely tracked together without a swap, with many cameras and with few?

python experiments/two_people.py [cameras=[12,4]] [frames=90] [seed=0]

Both people are rendered into one recording and are one energy (Eq. 8 caps the sum of both actors' blobs).
"""

import sys
from dataclasses import dataclass, field

from sogjax.cli.sweep.tables import table
from sogjax.run.result import row_numbers
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.tracked import track_rendered
from sogjax.synth.settings import SynthSettings


@dataclass
class Settings:
    """What is rendered, as `key=value` on the command line."""

    cameras: list[int] = field(default_factory=lambda: [12, 4])
    frames: int = 90
    seed: int = 0


def main() -> None:
    """Print the table."""
    settings = settings_from(Settings)
    rows = []
    for cameras in settings.cameras:
        rendered = SynthSettings("pass", actors=2, frames=settings.frames, cameras=cameras, seed=settings.seed)
        rows.append((f"{cameras} cameras", row_numbers(track_rendered(rendered))))
        print(*rows[-1], file=sys.stderr)
    print(machine_line())
    print(table(rows))


if __name__ == "__main__":
    run_script(main)
