"""`sogjax demo`: render a person, make the actor, track, evaluate; everything at once."""

from pathlib import Path

from sogjax.app.config.schemas import DemoConfig
from sogjax.app.track import run as run_track
from sogjax.engine.clock import RENDERING, clocked, stage
from sogjax.engine.outputs import results_folder
from sogjax.engine.run import Run
from sogjax.engine.run_folder import run_folder
from sogjax.engine.terminal import progress, say
from sogjax.settings.compose import track_config
from sogjax.synth import SynthSettings, cached_recording, default_cache_dir

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
