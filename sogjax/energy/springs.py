"""A quadratic model by the pose from what each camera says about the projected blobs."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.posed import Posed
from sogjax.energy.pulls import ImagePulls
from sogjax.model.camera import Camera, project, projection_jacobian
from sogjax.model.sog import Sog
from sogjax.solve.quadratic import QuadraticModel


def springs_model(
    posed: Posed,
    cameras: Camera,
    pulls_of: Callable[[Sog], ImagePulls],
    normalizers: Float[Array, "camera"],
) -> QuadraticModel:
    """The mean over the cameras of a normalised value with its gradient and the curvature of springs at the blobs.

    Args:
        posed: the body in the pose.
        cameras: a stack.
        pulls_of: of the body as projected into all cameras.
        normalizers: by which the values of each camera are divided.
    """
    value, by_mean, stiffness = _in_world(posed.blobs, cameras, pulls_of, normalizers)
    jacobian = posed.point_jacobian()
    stretched = jnp.einsum("bij,bjd->bid", stiffness, jacobian, precision="highest")
    flat = lambda array: array.reshape(-1, array.shape[-1])
    return QuadraticModel(
        value=value,
        gradient=jnp.matmul(by_mean.reshape(-1), flat(jacobian), precision="highest"),
        curvature=jnp.matmul(flat(jacobian).T, flat(stretched), precision="highest"),
    )


def _in_world(
    blobs: Sog, cameras: Camera, pulls_of: Callable[[Sog], ImagePulls], normalizers: Float[Array, "camera"]
) -> tuple[Float[Array, ""], Float[Array, "blob 3"], Float[Array, "blob 3 3"]]:
    """The value with its gradient and its stiffness by the blobs' means in the world."""

    def projected(means: Float[Array, "blob 3"]) -> tuple[tuple[Array, Array], Sog]:
        seen = jax.vmap(project, in_axes=(0, None))(cameras, eqx.tree_at(lambda b: b.means, blobs, means))
        return (seen.means, seen.sigmas), seen

    _, pull_back, seen = jax.vjp(projected, blobs.means, has_aux=True)
    pulls = pulls_of(seen)
    scale = 1.0 / (normalizers * normalizers.shape[0])
    (by_mean,) = pull_back((pulls.by_mean * scale[:, None, None], pulls.by_sigma * scale[:, None]))
    across = jax.vmap(projection_jacobian, in_axes=(0, None))(cameras, blobs.means)
    springs = jnp.where(seen.mask, pulls.stiffness, 0.0) * scale[:, None]
    stretched = across * springs[:, :, None, None]
    stiffness = jnp.einsum("cbki,cbkj->bij", across, stretched, precision="highest")
    return jnp.sum(pulls.value * scale), by_mean, stiffness
