"""What the cameras say of poses that are known, as the tracker would have judged them."""

from collections.abc import Iterable, Iterator

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.tracking.frame import FrameCells, TrackState, on_device
from sogjax.tracking.tracker import Tracker


def confidence_of_poses(
    tracker: Tracker, poses: Float[np.ndarray, "frame dof"], frames: Iterable[FrameCells]
) -> Iterator[LimbConfidence]:
    """Of one frame after the other; none where the tracker judges no limbs."""
    baseline = tracker.with_memory(TrackState.from_pose(jnp.asarray(poses[0], jnp.float32))).baseline
    if baseline is None:
        return
    for pose, frame in zip(poses, frames, strict=True):
        cells, beside = on_device(frame)
        found = _judged(tracker, cells, beside.present, jnp.asarray(pose, jnp.float32), baseline)
        baseline = found.baseline
        yield found


@eqx.filter_jit
def _judged(
    tracker: Tracker,
    cells: UInt8[Array, "camera rows columns 3"],
    present: Bool[Array, "camera"] | None,
    pose: Float[Array, "dof"],
    baseline: Float[Array, "2 blob"],
) -> LimbConfidence:
    odds = tracker.reader.odds(cells.astype(pose.dtype) / 255.0)
    windows = None
    if odds is not None:
        windows = tracker.reader.windows(odds, tracker.cameras, tracker.boxes(TrackState.from_pose(pose)))
        windows = windows if present is None else windows.of_present(present)
    return tracker.judged(pose, baseline, windows, cells, present)
