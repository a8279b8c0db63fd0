"""What goes into the tracking of one frame, and what comes out of it."""

from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt8

from sogjax.energy.keypoint_views import SeenKeypoints
from sogjax.model.sog import Sog
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.tracking.culling import Capacities


class FrameInput(NamedTuple):
    """What is known of one frame before it is tracked."""

    cells: UInt8[np.ndarray | Array, "camera rows columns 3"]
    """The colours of the cells (sRGB); those of a camera without a picture mean nothing."""
    present: Bool[np.ndarray | Array, "camera"] | None = None
    """The cameras that have a picture; None: all have."""
    keypoints: SeenKeypoints | None = None
    """What keypoint detectors saw; None: nothing is known."""


AnyFrame = FrameInput | UInt8[np.ndarray | Array, "camera rows columns 3"]
"""A frame of which perhaps only the cells are known."""


def on_device(frame: AnyFrame) -> FrameInput:
    """The frame with its arrays on jax's device."""
    known = frame if isinstance(frame, FrameInput) else FrameInput(frame)
    return FrameInput(*jax.tree.map(jnp.asarray, known))


class TrackState(eqx.Module):
    """The poses of the two frames before, how many of them are known (0, 1, 2), and what limbs are judged by."""

    previous: Float[Array, "dof"]
    before_previous: Float[Array, "dof"]
    num_known: Int[Array, ""]
    baseline: Float[Array, "2 blob"] | None = None
    """What was seen in the blobs' places so far (`LimbConfidence.baseline`); NaN where unknown, None: not judged."""
    expected: Float[Array, "dof"] | None = None
    """The pose that the next frame is expected to show; None: as the last two poses say."""

    @classmethod
    def from_pose(cls, pose: Float[Array, "dof"]) -> "TrackState":
        """The state before the first frame, from a rough pose."""
        return cls(pose, pose, jnp.asarray(0))

    def advanced(self, pose: Float[Array, "dof"]) -> "TrackState":
        """The state after a frame whose pose was found; the first one has no history but itself."""
        first = self.num_known == 0
        before = jnp.where(first, pose, self.previous)
        return TrackState(pose, before, jnp.minimum(self.num_known + 1, 2), self.baseline)


class FrameResult(eqx.Module):
    """What was found in one frame."""

    pose: Float[Array, "dof"]
    energy: Float[Array, ""]
    terms: dict[str, Float[Array, ""]]
    """The value of each term of the energy, without its weight."""
    iterations: Int[Array, ""]
    evaluations: Int[Array, ""]
    """Of the energy, with its gradient."""
    converged: Bool[Array, ""]
    num_near: Int[Array, "camera"]
    num_matching: Int[Array, "camera"]
    num_blocks: Int[Array, ""]
    """Blocks of near pairs; 0 where all pairs were compared."""
    limbs: LimbConfidence | None
    """What is thought of the limbs; None: they are not judged."""
    images: Sog
    """The image blobs that were used, for each camera (working colour space)."""


@dataclass
class TrackedFrame:
    """The result of one frame, the capacities it was computed with, and how long that took."""

    index: int
    result: FrameResult
    capacities: Capacities
    color_space: str
    """Of the colours in `result.images`."""
    seconds: float


def on_host(result: FrameResult) -> FrameResult:
    """The result with its small arrays on the host; the image blobs stay on the device until somebody needs them."""
    images, leaves = jax.tree.structure(result.images), jax.tree.leaves(result)
    small = len(leaves) - images.num_leaves  # `images` is the last field
    host = jax.device_get(leaves[:small])
    return jax.tree.unflatten(jax.tree.structure(result), [*host, *leaves[small:]])
