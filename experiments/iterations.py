"""What way does a solver take within a frame?

python experiments/iterations.py [recording=walk:0] [frame=20] [options=[solver=lbfgs]] [to=iterations.rrd]

Tracks up to the frame, prints the energy and how far blobs moved after each of the iterations there, and writes
them for Rerun: the skeleton on a timeline of iterations, and every joint's way as a line.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from sogjax.io.video import read_frames
from sogjax.study.iterations import check_showable, watched
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.settings import ReportConfig
from sogjax.study.source import source_named
from sogjax.view.rerun.comparison import write_iterations


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recording: str = ReportConfig().recordings[0]
    frame: int = 20
    """Counted from the recording's first."""
    options: list[str] = field(default_factory=list)
    """Of track."""
    out: str = ReportConfig().out
    """Where actors and cells are kept."""
    to: str = "iterations.rrd"


def main() -> None:
    """Print a line for each iteration, and write the file."""
    settings = settings_from(Settings)
    source = source_named(settings.recording, settings.frame + 1, Path(settings.out))
    check_showable(source, settings.frame)
    steps, energies = watched(source, settings.options, settings.frame)
    print(machine_line())
    previous = steps.blob_means[0]
    for number, (energy, blobs) in enumerate(zip(energies, steps.blob_means, strict=True)):
        moved = 1000.0 * float(np.linalg.norm(blobs - previous, axis=-1).max())
        print(f"iteration {number:3}   energy {energy:.6f}   a blob moved by up to {moved:6.1f} mm")
        previous = blobs
    pictures = next(iter(read_frames(source.recording, settings.frame, settings.frame + 1)))
    write_iterations(Path(settings.to), source.recording, steps, energies, pictures)
    print(settings.to)


if __name__ == "__main__":
    run_script(main)
