from .api.actors import Actor, load_actor, make_actor, save_actor
from .api.live import live
from .api.recordings import evaluate, load_motion, load_truth, open_recording, render_recording, write_rerun
from .api.stepping import make_tracker, read_cells
from .api.tracking import find_first_pose, track, track_settings
from .energy.term import Penalty, Term
from .errors import InputError
from .io.motion import Motion
from .io.recording import Recording
from .realtime.state import LiveState
from .settings.run import TrackConfig
from .tracking.frame import TrackState
from .tracking.tracker import Tracker

__all__ = [
    "Actor",
    "InputError",
    "LiveState",
    "Motion",
    "Penalty",
    "Recording",
    "Term",
    "TrackConfig",
    "TrackState",
    "Tracker",
    "evaluate",
    "find_first_pose",
    "live",
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
__version__: str
