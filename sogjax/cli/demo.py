"""`sogjax demo`: render a person, make the actor, track, evaluate; everything at once."""

from pathlib import Path

from sogjax.cli.config.schemas import DemoConfig
from sogjax.cli.track import run as run_track
from sogjax.io.cache_folder import default_cache_dir
from sogjax.run.clock import RENDERING, clocked, stage
from sogjax.run.outputs import results_folder
from sogjax.run.run import Run
from sogjax.run.run_folder import run_folder
from sogjax.run.terminal import progress, say
from sogjax.settings.compose import track_config
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings

COMMAND = "demo"


def run(config: DemoConfig) -> Run:
    """Render the demo recording if needed, and track it.

    Raises:
        InputError: a setting out of range, a folder that cannot be written, or one with results that are not of a demo.
    """
    out = Path(config.out)
    with results_folder(out):
        with run_folder(out, config.overwrite, config.resume, COMMAND):
            pass  # found out before anything is rendered
        with clocked():
            return _run_in(config, out)


def _run_in(config: DemoConfig, out: Path) -> Run:
    settings = SynthSettings(
        motion=config.motion,
        cameras=config.cameras,
        frames=config.frames,
        width=config.width,
        height=config.height,
        seed=config.seed,
    )
    with stage(RENDERING):
        recording = cached_recording(settings, default_cache_dir(), progress)
    say(f"rendered recording: {recording}")
    track = track_config(recording=recording, out=out, initial_pose="auto")
    track.outputs, track.overwrite, track.resume = config.outputs, config.overwrite, config.resume
    return run_track(track, COMMAND)
