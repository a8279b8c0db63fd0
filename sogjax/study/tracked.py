"""A recording tracked and evaluated, without results on disk."""

import json
from collections.abc import Sequence
from pathlib import Path

from sogjax.io.cache_folder import default_cache_dir
from sogjax.io.ground_truth import load_ground_truth
from sogjax.quality.evaluation import evaluate_motions
from sogjax.run.recordings import actors_of, opened
from sogjax.run.run import Run
from sogjax.run.terminal import progress
from sogjax.run.track import track_recording
from sogjax.settings.compose import track_config
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings


def track_rendered(settings: SynthSettings, overrides: Sequence[str] = ()) -> Run:
    """Track a rendered recording, made now if it is not there yet, and evaluate it; no results are written.

    Its averaged pictures are kept beside it, so that further runs do not decode them again.
    """
    cache = f"images.cache={json.dumps(str(default_cache_dir() / 'cells'))}"
    return track_folder(cached_recording(settings, progress=progress), [cache, *overrides])


def track_folder(folder: Path, overrides: Sequence[str] = ()) -> Run:
    """Track a recording with overrides of the track config, and evaluate it where there is ground truth."""
    config = track_config(overrides, recording=folder)
    recording = opened(config.recording, config.cameras)
    bodies, _ = actors_of(recording, config.actor, config.body, config.color, actors=config.actors)
    result = track_recording(recording, bodies, config)
    if recording.ground_truth is not None:
        result.evaluation = evaluate_motions(result.motions, load_ground_truth(recording.ground_truth))
    return result
