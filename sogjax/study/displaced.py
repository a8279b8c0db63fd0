"""Poses with a limb put elsewhere on purpose."""

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.model.body import Body
from sogjax.search.mirrored import means_of

NEAREST, FARTHEST = 0.2, 0.3
"""Metres, mean over the limb's blobs."""
DRAWS = 512


def displaced(
    body: Body,
    pose: Float[np.ndarray, "dof"],
    limb: Int[np.ndarray, "limb"],
    blobs: Bool[np.ndarray, "blob"],
    random: np.random.Generator,
) -> Float[np.ndarray, "dof"] | None:
    """The pose with a limb turned within its limits until it is 20 to 30 cm elsewhere; None: it cannot be so far."""
    lower, upper = np.asarray(body.skeleton.dof_lower)[limb], np.asarray(body.skeleton.dof_upper)[limb]
    poses = np.tile(pose, (DRAWS, 1)).astype(np.float32)
    far = random.uniform(0.2, 1.0, (DRAWS, 1))
    poses[:, limb] = (1.0 - far) * poses[:, limb] + far * random.uniform(lower, upper, (DRAWS, len(limb)))
    means = means_of(body, np.concatenate([pose[None].astype(np.float32), poses]))
    moved = np.linalg.norm(means[1:, blobs] - means[:1, blobs], axis=-1).mean(axis=1)
    right = np.flatnonzero((moved > NEAREST) & (moved < FARTHEST))
    return poses[right[0]] if len(right) else None
