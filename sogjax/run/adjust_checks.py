"""Whether a clip can be adjusted: long enough, and its pictures within memory."""

from sogjax.errors import InputError, counted
from sogjax.refine.pictures import bytes_of_frame
from sogjax.run import build
from sogjax.run.memory import available_memory

FEWEST_FRAMES = 5
"""Fewer say next to nothing about a shape, and have no motion to be smooth."""
WINDOW, LEAST_WINDOW = 60, 20
"""Frames that are adjusted together, by default and at least: windows overlap by ten."""
SPARE_MEMORY = 0.8
"""Part of the free memory that a window may take."""


def too_short(num_frames: int) -> str | None:
    """Why a motion of so many frames cannot be adjusted, if it is too short."""
    if num_frames >= FEWEST_FRAMES:
        return None
    return (
        f"the motion has {counted(num_frames, 'frame')}, too few to adjust; it stays as it is (track at least "
        f"{FEWEST_FRAMES})"
    )


def check_length(num_frames: int) -> None:
    """Check that there is something to adjust.

    Raises:
        InputError: there is not.
    """
    if (reason := too_short(num_frames)) is not None:
        raise InputError(reason)


def check_window(num_cameras: int, num_blobs: int, num_frames: int, window: int | None = None) -> None:
    """Check that the pictures of a window of a clip fit into memory.

    Args:
        num_cameras: of the recording.
        num_blobs: of the actor.
        num_frames: of the clip.
        window: that was asked for; None: `track` adjusts, which knows no other than the usual one.

    Raises:
        InputError: they do not.
    """
    if window is not None:
        build.at_least("window", window, LEAST_WINDOW)
    each, together = bytes_of_frame(num_cameras, num_blobs), min(WINDOW if window is None else window, num_frames)
    available = available_memory()
    if available is None or together * each <= SPARE_MEMORY * available:
        return
    asked = "adjust=true" if window is None else f"window={window}"
    fits = int(SPARE_MEMORY * available // each)
    if fits < LEAST_WINDOW:
        remedy = "track with fewer cameras (cameras=[...]), or use a machine with more memory"
    elif window is None:
        remedy = f"leave it out, and adjust the motion afterwards: sogjax adjust ... window={fits}"
    else:
        remedy = f"choose window={fits}"
    raise InputError(
        f"{asked}: the pictures of {counted(together, 'frame')} take about {together * each / 1e9:.1f} GB, "
        f"and {SPARE_MEMORY * available / 1e9:.1f} GB are free for them; {remedy}"
    )
