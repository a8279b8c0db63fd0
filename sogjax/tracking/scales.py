"""How far the degrees of freedom of a body may move in one step of a solver."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from sogjax.model.skeleton import Skeleton
from sogjax.solve import Scales


def pose_scales(
    skeleton: Skeleton,
    first_angle: float = 0.02,
    first_translation: float = 0.01,
    largest_angle: float = 0.15,
    largest_translation: float = 0.05,
) -> Scales:
    """Step lengths (radians, metres) for every degree of freedom; angles and translations of each actor are a kind."""
    kinds = _dof_kinds(skeleton)
    num_actors = int(kinds.max()) // 2 + 1
    return Scales(
        kinds=jnp.asarray(kinds),
        first_steps=jnp.tile(jnp.array([first_angle, first_translation]), num_actors),
        largest_steps=jnp.tile(jnp.array([largest_angle, largest_translation]), num_actors),
    )


def _dof_kinds(skeleton: Skeleton) -> Int[np.ndarray, "dof"]:
    """2 x the number of the tree a degree of freedom moves, + 1 for translations."""
    first_joint = np.argmax(np.asarray(skeleton.parameter_transform) != 0.0, axis=0)
    slides = ~np.asarray(skeleton.revolute)[first_joint]
    return (2 * np.array(skeleton.trees)[first_joint] + slides).astype(np.int32)
