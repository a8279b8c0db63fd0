"""`sogjax synth`: render a recording with ground truth."""

from dataclasses import asdict, fields
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from sogjax.cli.config.schemas import SynthConfig
from sogjax.errors import InputError
from sogjax.io.recording_files import RECORDING_FILES
from sogjax.run.terminal import progress
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

Part = TypeVar("Part", SynthSettings, DetectorSettings)


def run(config: SynthConfig) -> Path:
    """Render into a new folder.

    Raises:
        InputError: a setting out of range, or a folder that is not empty.
    """
    settings, detector = _part(SynthSettings, config), _part(DetectorSettings, config)
    settings.check()
    detector.check()
    out = Path(config.out)
    if config.overwrite and out.is_dir():
        _replace(out, settings, detector)
    else:
        render_recording(settings, out, progress, detector=detector)
    print(out)
    return out


def _part(schema: type[Part], config: SynthConfig) -> Part:
    """The settings of one of the schemas that the command's are put together from."""
    names = {entry.name for entry in fields(schema)}
    return schema(**{name: value for name, value in asdict(config).items() if name in names})


def _replace(out: Path, settings: SynthSettings, detector: DetectorSettings) -> None:
    """Render a recording in place of an older one, which is removed once the new one is complete."""
    rendered = [part.name for part in RECORDING_FILES if part.rendered]
    strange = sorted(path.name for path in out.iterdir() if path.name not in rendered)
    if strange:
        raise InputError(f"out={out}: holds {strange[0]}, not part of a rendered recording; choose another folder")
    with TemporaryDirectory(prefix=f".{out.name[:80]}.", suffix=".tmp", dir=out.absolute().parent) as beside:
        new, old = Path(beside) / "new", Path(beside) / "old"
        render_recording(settings, new, progress, detector=detector)
        out.rename(old)
        new.rename(out)
