"""A quadratic model by the pose from what each camera says about the projected blobs.

Terms that compare what each camera sees with the projected blobs.
"""

import abc
from collections.abc import Callable, Sequence
from functools import reduce
from operator import add

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.overlap import ImagePulls
from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Term
from sogjax.model.camera import Camera, project, projection_jacobian
from sogjax.model.sog import Sog
from sogjax.solve.solution import QuadraticModel


def gauss_newton_model(
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


class ImageTerm(Term):
    """The mean over the cameras of something that the pictures say, in units of the whole picture as in Eq. 9."""

    @abc.abstractmethod
    def pulls(self, posed: Posed, seen: Sog, frame: Frame) -> ImagePulls:
        """What each camera says, without weight and not yet in those units; `seen` is the body projected into all."""

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """Value, gradient and the curvature of the springs."""
        return images_model([self], posed, frame)


def images_model(terms: Sequence[ImageTerm], posed: Posed, frame: Frame) -> QuadraticModel:
    """Of the sum of several, which is brought from the pictures to the pose once."""

    def pulls_of(seen: Sog) -> ImagePulls:
        weighted = [
            jax.tree.map(lambda leaf, term=term: term.signed_weight * leaf, term.pulls(posed, seen, frame))
            for term in terms
        ]
        return reduce(lambda a, b: jax.tree.map(add, a, b), weighted)

    return gauss_newton_model(posed, frame.views.cameras, pulls_of, frame.views.normalizers)
