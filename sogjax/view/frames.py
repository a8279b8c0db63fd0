"""Which frames of a recording a view shows."""

from collections.abc import Sequence

from sogjax.data.motion import Motion
from sogjax.data.recording import Recording
from sogjax.errors import InputError


def frame_range(recording: Recording, motions: Sequence[Motion]) -> tuple[int, int]:
    """[first, stop) of the frames from the motions' first to their last, by the recording's own numbers.

    Raises:
        InputError: the recording does not have them all.
    """
    first = min(int(motion.frame[0]) for motion in motions)
    stop = max(int(motion.frame[-1]) for motion in motions) + 1
    end = recording.first_frame + recording.num_frames
    if first < recording.first_frame or stop > end:
        raise InputError(
            f"{recording.path}: the motion has frames {first} to {stop - 1}, the recording "
            f"{recording.first_frame} to {end - 1}; give the recording that was tracked"
        )
    return first, stop
