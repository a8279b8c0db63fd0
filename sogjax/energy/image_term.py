"""Terms that compare what each camera sees with the projected blobs."""

import abc
from collections.abc import Sequence
from functools import reduce
from operator import add

import jax

from sogjax.energy.posed import Frame, Posed
from sogjax.energy.pulls import ImagePulls
from sogjax.energy.springs import springs_model
from sogjax.energy.term import Term
from sogjax.model.sog import Sog
from sogjax.solve.quadratic import QuadraticModel


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

    return springs_model(posed, frame.views.cameras, pulls_of, frame.views.normalizers)
