"""Terms that compare what each camera sees with the projected blobs, and their quadratic model by the pose."""

import abc
from collections.abc import Sequence
from functools import reduce
from operator import add

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.overlap import ImagePulls
from sogjax.energy.posed import Frame, Posed
from sogjax.energy.term import Term
from sogjax.model.camera import project, projection_jacobian
from sogjax.model.sog import Sog
from sogjax.solve.solution import QuadraticModel


class ImageTerm(Term):
    """The mean over the cameras of something that the pictures say, in units of the whole picture as in Eq. 9."""

    @abc.abstractmethod
    def pulls(self, posed: Posed, seen: Sog, frame: Frame) -> ImagePulls:
        """What each camera says, without weight and not yet in those units; `seen` is the body projected into all."""

    def quadratic(self, posed: Posed, frame: Frame) -> QuadraticModel:
        """Value, gradient and the curvature of the springs."""
        return images_model([self], posed, frame)


def images_model(terms: Sequence[ImageTerm], posed: Posed, frame: Frame) -> QuadraticModel:
    """The model of the sum of several terms, which is brought from the pictures to the pose once."""
    blobs, cameras, normalizers = posed.blobs, frame.views.cameras, frame.views.normalizers

    def projected(means: Float[Array, "blob 3"]) -> tuple[tuple[Array, Array], Sog]:
        seen = jax.vmap(project, in_axes=(0, None))(cameras, eqx.tree_at(lambda b: b.means, blobs, means))
        return (seen.means, seen.sigmas), seen

    _, pull_back, seen = jax.vjp(projected, blobs.means, has_aux=True)
    pulls = weighted_pulls(terms, posed, seen, frame)
    scale = 1.0 / (normalizers * normalizers.shape[0])
    (by_mean,) = pull_back((pulls.by_mean * scale[:, None, None], pulls.by_sigma * scale[:, None]))
    across = jax.vmap(projection_jacobian, in_axes=(0, None))(cameras, blobs.means)
    springs = jnp.where(seen.mask, pulls.stiffness, 0.0) * scale[:, None]
    stretched = across * springs[:, :, None, None]
    stiffness = jnp.einsum("cbki,cbkj->bij", across, stretched, precision="highest")
    return gauss_newton_model(jnp.sum(pulls.value * scale), by_mean, stiffness, posed.point_jacobian())


def weighted_pulls(terms: Sequence[ImageTerm], posed: Posed, seen: Sog, frame: Frame) -> ImagePulls:
    """What each camera says of a projected body, summed over terms with their weights."""
    weighted = [
        jax.tree.map(lambda leaf, term=term: term.signed_weight * leaf, term.pulls(posed, seen, frame))
        for term in terms
    ]
    return reduce(lambda a, b: jax.tree.map(add, a, b), weighted)


def gauss_newton_model(
    value: Float[Array, ""],
    by_point: Float[Array, "point 3"],
    stiffness: Float[Array, "point 3 3"],
    jacobian: Float[Array, "point 3 param"],
) -> QuadraticModel:
    """A model by some parameters, from the gradient by points in the world and the springs that hold these."""
    flat = lambda array: array.reshape(-1, array.shape[-1])
    stretched = jnp.einsum("bij,bjd->bid", stiffness, jacobian, precision="highest")
    return QuadraticModel(
        value=value,
        gradient=jnp.matmul(by_point.reshape(-1), flat(jacobian), precision="highest"),
        curvature=jnp.matmul(flat(jacobian).T, flat(stretched), precision="highest"),
    )
