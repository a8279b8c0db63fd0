"""`sogjax synth`: render a recording with ground truth."""

from dataclasses import asdict, fields
from pathlib import Path
from tempfile import TemporaryDirectory

from sogjax.app.config.schemas import SynthConfig
from sogjax.engine.terminal import progress
from sogjax.errors import InputError
from sogjax.synth import SynthSettings, render_recording

RENDERED = (
    *("calibration.toml", "recording.yaml", "ground_truth.npz", "initial_pose.yaml"),
    *("videos", "example_poses", "background"),
)
"""What a rendered recording consists of."""


def run(config: SynthConfig) -> Path:
    """Render into a new folder.

    Raises:
        InputError: a setting out of range, or a folder that is not empty.
    """
    names = {entry.name for entry in fields(SynthSettings)}
    settings = SynthSettings(**{name: value for name, value in asdict(config).items() if name in names})
    settings.check()
    out = Path(config.out)
    if config.overwrite and out.is_dir():
        _replace(out, settings)
    else:
        render_recording(settings, out, progress)
    print(out)
    return out


def _replace(out: Path, settings: SynthSettings) -> None:
    """Render a recording in place of an older one, which is removed once the new one is complete."""
    strange = sorted(path.name for path in out.iterdir() if path.name not in RENDERED)
    if strange:
        raise InputError(f"out={out}: holds {strange[0]}, not part of a rendered recording; choose another folder")
    with TemporaryDirectory(prefix=f".{out.name[:80]}.", suffix=".tmp", dir=out.absolute().parent) as beside:
        new, old = Path(beside) / "new", Path(beside) / "old"
        render_recording(settings, new, progress)
        out.rename(old)
        new.rename(out)
