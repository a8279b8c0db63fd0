"""The pass that smooths the frames, once all of them are found: a low-pass filter without delay."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from sogjax.errors import InputError
from sogjax.io.frame_table import FramesRecord, FrameTable
from sogjax.model.body import Body

ORDER = 4
"""Of the filter as a whole, as it is usual in biomechanics: it goes forward and back, which doubles the order."""
HIGHEST = 0.9
"""Part of half the frame rate that the cut-off may reach: nearer to it, nothing is filtered and the ends ring."""
LEAST = 4
"""Frames that can be filtered, at least."""


class Filtered(FramesRecord):
    """The frames with their poses smoothed, and these as they were; what was found of them stays."""

    file = "filtered.npz"


def check_cutoff(cutoff: float | None, fps: float) -> None:
    """Check a cut-off (Hz) for frames that come `fps` times a second.

    Raises:
        InputError: it is not positive, or too near half the frame rate.
    """
    if cutoff is None:
        return
    if not np.isfinite(cutoff) or cutoff <= 0.0:
        raise InputError(f"outputs.filter={cutoff:g}: must be a positive number of Hz; null turns it off")
    most = HIGHEST * 0.5 * fps
    if cutoff > most:
        raise InputError(
            f"outputs.filter={cutoff:g}: is too near {0.5 * fps:g} Hz, half the rate of the frames that are tracked "
            f"({fps:g} a second); give at most {most:.3g}, or null to leave the motion as it is"
        )


def filter_frames(table: FrameTable, cutoff: float | None, fps: float, bodies: Sequence[Body]) -> Filtered:
    """The frames with their poses filtered.

    Args:
        table: the frames.
        cutoff: in Hz, where half of the power is left.
        fps: frames per second of those in the table.
        bodies: the actors, whose angles are taken along the shorter way.
    """
    assert cutoff is not None
    turns = np.concatenate([body.skeleton.turning for body in bodies])
    changed = {"pose": smooth(table.pose, cutoff, fps, turns), "unfiltered_pose": table.pose}
    return Filtered(FrameTable.from_arrays(table.arrays() | changed))


def smooth(
    poses: Float[np.ndarray, "frame dof"], cutoff: float, fps: float, turns: Bool[np.ndarray, "dof"]
) -> Float[np.ndarray, "frame dof"]:
    """A zero-phase Butterworth filter of `ORDER` over every degree of freedom; of few frames nothing is changed."""
    from scipy.signal import butter, sosfiltfilt  # half a second, which runs without a filter need not wait

    if len(poses) < LEAST:
        return poses
    values = np.asarray(poses, float)
    values = np.where(turns[None], np.unwrap(values, axis=0), values)
    # Going forward and back doubles the loss at the cut-off; it is moved so that both together lose 3 dB there.
    moved = np.tan(np.pi * cutoff / fps) / (np.sqrt(2.0) - 1.0) ** (1.0 / ORDER)
    sections = butter(ORDER // 2, np.arctan(moved) * fps / np.pi, fs=fps, output="sos")
    padding = min(3 * ORDER + round(fps / cutoff), len(poses) - 1)
    return sosfiltfilt(sections, values, axis=0, padlen=padding).astype(poses.dtype)


def filter_name(cutoff: float) -> str:
    """What a file says of a motion that was filtered."""
    return f"Butterworth low-pass, order {ORDER}, zero phase, {cutoff:g} Hz"
