"""`sogjax synth`: render a recording with ground truth."""

from dataclasses import asdict, fields
from pathlib import Path

from sogjax.app.configs import SynthConfig
from sogjax.app.progress import progress
from sogjax.synth import SynthSettings, render_recording


def run(config: SynthConfig) -> Path:
    """Render into a new folder.

    Raises:
        InputError: a setting out of range, or a folder that is not empty.
    """
    names = {entry.name for entry in fields(SynthSettings)}
    settings = SynthSettings(**{name: value for name, value in asdict(config).items() if name in names})
    path = render_recording(settings, Path(config.out), progress)
    print(path)
    return path
