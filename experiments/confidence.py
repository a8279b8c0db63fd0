"""Are the standard deviations of the joints right, and what temperature makes them so?

python experiments/confidence.py [calibrate=[walk:0]] [check=[squat_kick:1,...]] [frames=40] [out=FOLDER]

The temperature is calibrated on some recordings and looked at on others; `outputs.temperature` is its default.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sogjax.settings import OutputsConfig
from sogjax.study.machine import machine_line
from sogjax.study.script import run_script, settings_from
from sogjax.study.settings import USUAL_FRAMES, ReportConfig
from sogjax.study.stated_errors import StatedErrors, calibrated_temperature, stated_errors
from sogjax.study.study import Study


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    calibrate: list[str] = field(default_factory=lambda: ReportConfig().recordings[:1])
    check: list[str] = field(default_factory=lambda: ReportConfig().recordings[1:])
    frames: int = USUAL_FRAMES
    out: str = ReportConfig().out
    """Where actors and cells are kept."""


def main() -> None:
    """Calibrate, then print a line for each recording and its bins."""
    settings = settings_from(Settings)
    study = Study(Path(settings.out), settings.calibrate, settings.frames)
    temperature = calibrated_temperature(
        [study.source(name) for name in settings.calibrate], OutputsConfig().temperature
    )
    print(machine_line())
    print(f"outputs.temperature={temperature:.3g}, calibrated on {', '.join(settings.calibrate)}\n")
    for name in [*settings.calibrate, *settings.check]:
        print_line(name, stated_errors(study.source(name), temperature))


def print_line(name: str, result: StatedErrors) -> None:
    """How right the deviations of a recording are."""
    print(
        f"{name:<16}found/said {np.sqrt(result.mean_square_ratio):.2f}   below 1, 2 deviations "
        f"{result.within(1.0):.0%} {result.within(2.0):.0%}   rank correlation {result.rank_correlation:.2f}"
    )
    said, found = (" ".join(f"{1000.0 * value:6.1f}" for value in values) for values in result.binned())
    print(f"    said, mm  {said}\n    found, mm {found}")


if __name__ == "__main__":
    run_script(main)
