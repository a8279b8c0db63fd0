"""What is known of a pose without looking: joint limits and smooth motion (the penalties of Eq. 10)."""

import jax.numpy as jnp
from jaxtyping import Array, Float


def limit_penalty(
    joint_params: Float[Array, "joint"], lower: Float[Array, "joint"], upper: Float[Array, "joint"]
) -> Float[Array, ""]:
    """E_lim: squared distances of the joint parameters Lambda from their limits; 0 within."""
    below = jnp.maximum(lower - joint_params, 0.0)
    above = jnp.maximum(joint_params - upper, 0.0)
    return jnp.sum(below**2) + jnp.sum(above**2)


def acceleration_penalty(
    pose: Float[Array, "dof"], previous: Float[Array, "dof"], before_previous: Float[Array, "dof"]
) -> Float[Array, ""]:
    """E_acc: squared distance of the previous pose from the middle of its neighbours in time."""
    return jnp.sum((0.5 * (before_previous + pose) - previous) ** 2)
