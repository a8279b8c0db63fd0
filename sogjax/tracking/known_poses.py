"""What the cameras say of poses that are known, as the tracker would have judged them."""

from collections.abc import Iterable, Iterator

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.tracking.frame import AnyFrame, FrameInput, TrackState, on_device
from sogjax.tracking.tracker import Tracker


def confidence_of_poses(
    tracker: Tracker, poses: Float[np.ndarray, "frame dof"], frames: Iterable[AnyFrame]
) -> Iterator[LimbConfidence]:
    """Of one frame after the other; none where the tracker judges no limbs."""
    baseline = tracker.with_memory(TrackState.from_pose(jnp.asarray(poses[0], jnp.float32))).baseline
    if baseline is None:
        return
    for pose, frame in zip(poses, frames, strict=True):
        found = _judged(tracker, on_device(frame), jnp.asarray(pose, jnp.float32), baseline)
        baseline = found.baseline
        yield found


@eqx.filter_jit
def _judged(
    tracker: Tracker, frame: FrameInput, pose: Float[Array, "dof"], baseline: Float[Array, "2 blob"]
) -> LimbConfidence:
    return tracker.judged(pose, baseline, tracker.windows(frame, TrackState.from_pose(pose)), frame)
