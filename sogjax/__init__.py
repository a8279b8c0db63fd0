"""Markerless motion capture by Sums of Gaussians (Stoll et al., ICCV 2011) in JAX.

From videos to a motion::

    import sogjax

    recording = sogjax.open_recording("walk")
    actor = sogjax.make_actor(recording)
    motion = sogjax.track(recording, actor)
    motion.save("walk.bvh")

Importing the package loads nothing else; each name is loaded when it is first used.
"""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.api.actors import load_actor, make_actor, save_actor
    from sogjax.api.evaluation import evaluate
    from sogjax.api.motions import load_motion, write_rerun
    from sogjax.api.recordings import load_truth, open_recording, render_recording
    from sogjax.api.settings import track_settings
    from sogjax.api.stepping import make_tracker, read_cells
    from sogjax.api.tracking import find_first_pose, track
    from sogjax.data.motion import Motion
    from sogjax.data.recording import Recording
    from sogjax.energy.term import Penalty, Term
    from sogjax.errors import InputError
    from sogjax.model.body import Body as Actor
    from sogjax.settings import TrackConfig
    from sogjax.tracking.frame import TrackState
    from sogjax.tracking.tracker import Tracker

__version__ = "0.1.0"

__all__ = [
    "Actor",
    "InputError",
    "Motion",
    "Penalty",
    "Recording",
    "Term",
    "TrackConfig",
    "TrackState",
    "Tracker",
    "evaluate",
    "find_first_pose",
    "load_actor",
    "load_motion",
    "load_truth",
    "make_actor",
    "make_tracker",
    "open_recording",
    "read_cells",
    "render_recording",
    "save_actor",
    "track",
    "track_settings",
    "write_rerun",
]

_HOMES = {
    "Actor": "sogjax.model.body:Body",
    "InputError": "sogjax.errors",
    "Motion": "sogjax.data.motion",
    "Penalty": "sogjax.energy.term",
    "Recording": "sogjax.data.recording",
    "Term": "sogjax.energy.term",
    "TrackConfig": "sogjax.settings",
    "TrackState": "sogjax.tracking.frame",
    "Tracker": "sogjax.tracking.tracker",
    "evaluate": "sogjax.api.evaluation",
    "find_first_pose": "sogjax.api.tracking",
    "load_actor": "sogjax.api.actors",
    "load_motion": "sogjax.api.motions",
    "load_truth": "sogjax.api.recordings",
    "make_actor": "sogjax.api.actors",
    "make_tracker": "sogjax.api.stepping",
    "open_recording": "sogjax.api.recordings",
    "read_cells": "sogjax.api.stepping",
    "render_recording": "sogjax.api.recordings",
    "save_actor": "sogjax.api.actors",
    "track": "sogjax.api.tracking",
    "track_settings": "sogjax.api.settings",
    "write_rerun": "sogjax.api.motions",
}

__getattr__, _ = lazy_names(__name__, _HOMES)


def __dir__() -> list[str]:
    return sorted({*__all__, "__version__"})
