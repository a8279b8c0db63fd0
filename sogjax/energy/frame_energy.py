"""The energy of a frame (Eq. 10): a sum of terms."""

from functools import reduce
from operator import add
from typing import TypeVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from sogjax.energy.foreground import Foreground
from sogjax.energy.image_term import ImageTerm, images_model
from sogjax.energy.overlap import EXACT_EXPONENT, GradientMode
from sogjax.energy.posed import Frame, History, Posed
from sogjax.energy.priors import AccelerationPenalty, LimitPenalty
from sogjax.energy.similarity import Similarity, similarity_among
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.body import Body
from sogjax.solve.solution import QuadraticModel

Summand = TypeVar("Summand", Array, QuadraticModel)


class FrameEnergy(eqx.Module):
    """The energy of one frame as a function of the pose, to be maximised."""

    body: Body
    views: Views
    history: History
    terms: Terms

    def __check_init__(self) -> None:
        names = [term.name for term in self.terms]
        if len(set(names)) < len(names):
            raise ValueError(f"two terms of the energy have the same name: {', '.join(names)}")

    @property
    def frame(self) -> Frame:
        """What is known of the frame without a pose."""
        return Frame(self.views, self.history)

    def __call__(self, pose: Float[Array, "dof"]) -> Float[Array, ""]:
        """The energy at a pose."""
        posed = Posed.from_pose(self.body, pose)
        return _total([term.part(posed, self.frame) for term in self.terms])

    def quadratic(self, pose: Float[Array, "dof"]) -> QuadraticModel:
        """Value, gradient and a positive semi-definite curvature at a pose."""
        posed = Posed.from_pose(self.body, pose)
        of_images = [term for term in self.terms if isinstance(term, ImageTerm)]
        others = [term.quadratic(posed, self.frame) for term in self.terms if not isinstance(term, ImageTerm)]
        return _total([images_model(of_images, posed, self.frame), *others] if of_images else others)

    def values(self, pose: Float[Array, "dof"]) -> dict[str, Float[Array, ""]]:
        """The value of every term at a pose, without its weight, by name."""
        posed = Posed.from_pose(self.body, pose)
        return {term.name: term.value(posed, self.frame) for term in self.terms}

    def values_given(self, pose: Float[Array, "dof"], energy: Float[Array, ""]) -> dict[str, Float[Array, ""]]:
        """The values at a pose whose energy is known: the similarity is what the other terms leave of it.

        So the pictures are not looked at again; 0 for a similarity without weight.
        """
        posed = Posed.from_pose(self.body, pose)
        seen = next((term for term in self.terms if isinstance(term, Similarity)), None)
        values = {term.name: term.value(posed, self.frame) for term in self.terms if term is not seen}
        if seen is None:
            return values
        others = [term.signed_weight * values[term.name] for term in self.terms if term is not seen]
        left = energy - reduce(add, others) if others else energy
        weight = jnp.where(seen.weight == 0.0, jnp.inf, seen.weight)
        return {seen.name: left / weight} | values

    def near(self, pose: Float[Array, "dof"], capacity: int) -> tuple["FrameEnergy", Int[Array, ""]]:
        """This energy with only the pairs of blobs that matter near a pose, and how many blocks those are.

        Raises:
            ValueError: the energy has no similarity.
        """
        exponent = similarity_among(self.terms).exponent
        views, count = self.views.near(self.body.posed_blobs(pose), exponent, capacity)
        return FrameEnergy(self.body, views, self.history, self.terms), count


def standard_terms(
    limit_weight: float | Array = 1.0,
    acceleration_weight: float | Array = 0.01,
    exponent: float | Array = EXACT_EXPONENT,
    capped: bool = True,
    gradient: GradientMode = "forward",
    foreground_weight: float | Array = 0.0,
) -> Terms:
    """The terms of Eq. 10, with the commands' defaults, and the foreground's where it has a weight."""
    similarity = Similarity(1.0, exponent=exponent, capped=capped, gradient=gradient)
    terms = (similarity, LimitPenalty(limit_weight), AccelerationPenalty(acceleration_weight))
    counts = not isinstance(foreground_weight, int | float) or foreground_weight != 0.0
    return (*terms, Foreground(foreground_weight)) if counts else terms


def still_energy(body: Body, pose: Float[Array, "dof"], views: Views, terms: Terms) -> Float[Array, ""]:
    """The energy of a frame without history."""
    return FrameEnergy(body, views, History.unknown(pose), terms)(pose)


def _total(parts: list[Summand]) -> Summand:
    """The sum: the later parts first, which are small beside the similarity."""
    return parts[0] + reduce(lambda a, b: a + b, parts[1:]) if len(parts) > 1 else parts[0]
