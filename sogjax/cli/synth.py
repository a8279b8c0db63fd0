"""`sogjax synth`, which renders a recording with ground truth, and `sogjax demo`, which tracks one, too."""

from dataclasses import asdict, fields
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from sogjax.cli import track
from sogjax.cli.schemas import DemoConfig, SynthConfig
from sogjax.errors import InputError
from sogjax.io.cache_folder import default_cache_dir
from sogjax.io.recording_files import RECORDING_FILES
from sogjax.run.clock import RENDERING, clocked, stage
from sogjax.run.result import RunResult
from sogjax.run.run_folder import results_folder, run_folder
from sogjax.run.terminal import progress, say
from sogjax.settings.compose import track_config
from sogjax.synth.cache import cached_recording
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

Part = TypeVar("Part", SynthSettings, DetectorSettings)

DEMO = "demo"
"""The command of a run of the demo, as its folder notes it."""


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


def demo(config: DemoConfig) -> RunResult:
    """Render the demo's recording if needed, make the actor, track, evaluate.

    Raises:
        InputError: a setting out of range, a folder that cannot be written, or one with results that are not of a demo.
    """
    out = Path(config.out)
    with results_folder(out), clocked():
        with run_folder(out, config.overwrite, config.resume, DEMO):
            pass  # found out before anything is rendered
        with stage(RENDERING):
            recording = cached_recording(_part(SynthSettings, config), default_cache_dir(), progress)
        say(f"rendered recording: {recording}")
        of_track = track_config(recording=recording, out=out, initial_pose="auto")
        of_track.outputs, of_track.overwrite, of_track.resume = config.outputs, config.overwrite, config.resume
        return track.run(of_track, DEMO)


def _part(schema: type[Part], config: SynthConfig | DemoConfig) -> Part:
    """The settings of a schema that are among a command's; the others as they are by default."""
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
