"""How many iterations does each solver need on a cartwheel, and does it keep the arms?

python experiments/ascent.py [motion=cartwheel] [frames=105] [cameras=12] [seed=0]

The paper: 34.56 iterations a frame for the conditioned ascent, 65.38 for plain gradient ascent, which lost the arms
in some frames. Iterations of the optimistix solvers count their line-search steps.
"""

import sys
from dataclasses import dataclass

from sogjax.app.script import machine_line, run_script, settings_from, track_rendered
from sogjax.app.sweep import row_numbers, table
from sogjax.synth import SynthSettings

SOLVERS = ("conditioned_ascent", "gradient_ascent", "bfgs", "lbfgs", "nonlinear_cg")


@dataclass
class Settings:
    """What is rendered, as `key=value` on the command line."""

    motion: str = "cartwheel"
    frames: int = 105
    cameras: int = 12
    seed: int = 0


def main() -> None:
    """Print the table."""
    settings = settings_from(Settings)
    rendered = SynthSettings(settings.motion, frames=settings.frames, cameras=settings.cameras, seed=settings.seed)
    rows = []
    for solver in SOLVERS:
        rows.append((solver, row_numbers(track_rendered(rendered, [f"solver={solver}"]))))
        print(*rows[-1], file=sys.stderr)
    print(machine_line())
    print(table(rows))


if __name__ == "__main__":
    run_script(main)
