"""Motions from files, and to look at."""

from collections.abc import Sequence
from pathlib import Path

from sogjax.data import motion as motions
from sogjax.data.ground_truth import load_ground_truth
from sogjax.data.motion import Motion
from sogjax.data.recording import Recording
from sogjax.data.video import read_frames
from sogjax.engine.terminal import progress
from sogjax.view.frames import frame_range


def load_motion(path: str | Path) -> Motion:
    """The motion of a file `motion.npz`, or of the folder in which a run that was stopped keeps its frames so far.

    Raises:
        InputError: no such file, another version, or an array that is missing, misshapen or not finite.
    """
    return motions.load_motion(Path(path))


def write_rerun(path: str | Path, recording: Recording, motion: Motion | Sequence[Motion], images: bool = True) -> None:
    """Write a Rerun file (`rerun FILE` opens it): cameras, pictures, skeletons, blobs, curves and true markers.

    Args:
        path: the `.rrd` file; it is replaced as a whole.
        recording: in which was tracked.
        motion: one, or a list of them.
        images: whether the pictures are read and put into the file.

    Raises:
        InputError: the file cannot be written, a picture cannot be read, or frames that the recording does not have.
    """
    from sogjax.view import rerun

    shown = [motion] if isinstance(motion, Motion) else list(motion)
    first, stop = (number - recording.first_frame for number in frame_range(recording, shown))
    rerun.write_rerun(
        Path(path),
        recording,
        shown,
        names=[each.actor for each in shown] if all(each.actor for each in shown) else None,
        frames=read_frames(recording, first, stop) if images else None,
        truth=None if recording.ground_truth is None else load_ground_truth(recording.ground_truth),
        progress=progress,
    )
