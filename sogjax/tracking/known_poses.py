"""What the cameras say of poses that are known, as the tracker would have judged them."""

from collections.abc import Iterable, Iterator

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.quality.limb_confidence import Judgement
from sogjax.tracking.frame import FrameCells, TrackState, on_device
from sogjax.tracking.tracker import Tracker


def judged_poses(
    tracker: Tracker, poses: Float[np.ndarray, "frame dof"], frames: Iterable[FrameCells]
) -> Iterator[Judgement]:
    """Of one frame after the other; none where the tracker judges no limbs."""
    usual = tracker.with_memory(TrackState.from_pose(jnp.asarray(poses[0], jnp.float32))).usual
    if usual is None:
        return
    for pose, frame in zip(poses, frames, strict=True):
        cells, beside = on_device(frame)
        found = _judged(tracker, cells, beside.present, jnp.asarray(pose, jnp.float32), usual)
        usual = found.usual
        yield found


@eqx.filter_jit
def _judged(
    tracker: Tracker,
    cells: UInt8[Array, "camera rows columns 3"],
    present: Bool[Array, "camera"] | None,
    pose: Float[Array, "dof"],
    usual: Float[Array, "2 blob"],
) -> Judgement:
    odds = tracker.reader.odds(cells.astype(pose.dtype) / 255.0)
    windows = None
    if odds is not None:
        windows = tracker.reader.windows(odds, tracker.cameras, tracker.boxes(TrackState.from_pose(pose)))
        windows = windows if present is None else windows.of_present(present)
    return tracker.judged(pose, usual, windows, cells, present)
