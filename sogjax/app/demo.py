"""`sogjax demo`: render a person, make the actor, track, evaluate; everything at once."""

import time
from pathlib import Path

from sogjax.app.composition import composed
from sogjax.app.configs import DemoConfig, TrackConfig
from sogjax.app.job import Run
from sogjax.app.outputs import results_folder
from sogjax.app.overrides import quoted_value
from sogjax.app.progress import progress
from sogjax.app.recordings import say
from sogjax.app.run_folder import run_folder
from sogjax.app.track import run as run_track
from sogjax.synth import SynthSettings, cached_recording, default_cache_dir

COMMAND = "demo"


def run(config: DemoConfig) -> Run:
    """Render the demo recording if it is not there, and track it.

    Raises:
        InputError: a setting out of range, a folder that cannot be written, or one with results that no demo made.
    """
    out = Path(config.out)
    with results_folder(out):
        with run_folder(out, config.overwrite, config.resume, COMMAND):
            pass  # found out before anything is rendered
        return _run_in(config, out)


def _run_in(config: DemoConfig, out: Path) -> Run:
    begin = time.perf_counter()
    settings = SynthSettings(
        motion=config.motion,
        cameras=config.cameras,
        frames=config.frames,
        width=config.width,
        height=config.height,
        seed=config.seed,
    )
    recording = cached_recording(settings, default_cache_dir(), progress)
    say(f"rendered recording: {recording}")
    rendered = time.perf_counter()
    track_config: TrackConfig = composed(
        "track", [f"recording={quoted_value(str(recording))}", f"out={quoted_value(str(out))}", "initial_pose=auto"]
    )
    track_config.outputs = config.outputs
    track_config.overwrite, track_config.resume = config.overwrite, config.resume
    result = run_track(track_config, COMMAND)
    print(
        f"rendering {rendered - begin:.1f} s (0 when it was there already), "
        f"actor, tracking and outputs {time.perf_counter() - rendered:.1f} s"
    )
    return result
