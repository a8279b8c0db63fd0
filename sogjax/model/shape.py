"""Shape parameters: the lengths and sizes of a body that are scaled together (Section 5.2)."""

from collections.abc import Sequence
from dataclasses import fields

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.model.body import Body, ShapeGroup

LENGTH_SPREAD = 0.05
"""Expected deviation of a bone's scale factor from the whole body's (logarithm): people's proportions are alike."""
END_SPREAD = 0.1
"""Expected deviation of the scale factor (logarithm) of what a skeleton ends with, as hands, feet and heads: shoes and
hair add to them."""
SIZE_SPREAD = 0.2
"""Expected deviation of the scale factors (logarithm) of places across a bone and of sizes, which clothes change."""
WHOLE_SPREAD = 0.15
"""Expected deviation of the whole body's scale factor (logarithm): three times as much as grown-ups differ. Masks
that show somebody tell it far better; those that say nothing of most of him must not make a child or a giant of him."""
USUAL, BEYOND = 1.5, 100.0
"""Within how many expected deviations the sizes of a body are, and what the square of each further one counts: of 200
actors nine had a size beyond, six of them feet with their shadows."""


class ShapeModel(eqx.Module):
    """A body and how its lengths and sizes follow from shape parameters.

    Shape parameters are logarithms of scale factors: the first scales the whole body, the others one group of the
    body file each. All zero gives the body itself.
    """

    body: Body
    joint_groups: Float[Array, "joint shape"]
    blob_groups: Float[Array, "blob shape"]
    sigma_groups: Float[Array, "blob shape"]
    landmark_groups: Float[Array, "landmark shape"]
    names: tuple[str, ...] = eqx.field(static=True)
    """The names of the shape parameters."""
    spread: Float[Array, "shape"]
    """Expected deviation of each shape parameter from 0."""

    @classmethod
    def from_body(cls, body: Body, symmetric: bool = True) -> "ShapeModel":
        """Read the groups of a body; without symmetry left and right have shape parameters of their own."""
        groups = body.shape_groups if symmetric else _untied(body.shape_groups)

        def membership(names: tuple[str, ...], field: str) -> Array:
            """1 where a shape parameter scales a named item; the first one scales all."""
            table = np.ones((len(names), 1 + len(groups)))
            for k, group in enumerate(groups):
                table[:, k + 1] = [name in getattr(group, field) for name in names]
            return jnp.asarray(table, body.blob_sigmas.dtype)

        return cls(
            body,
            membership(body.skeleton.names, "joint_offsets"),
            membership(body.blobs.names, "blob_offsets"),
            membership(body.blobs.names, "blob_sigmas"),
            membership(body.landmarks.names, "landmark_offsets"),
            ("whole_body", *(group.name for group in groups)),
            jnp.asarray([WHOLE_SPREAD, *(_spread(group, body) for group in groups)], body.blob_sigmas.dtype),
        )

    @property
    def num_shape_params(self) -> int:
        """One for the whole body and one for each group."""
        return self.joint_groups.shape[1]

    def unusual_names(self, shape_params: Float[Array, "shape"]) -> list[str]:
        """The names of the sizes that are beyond what is usual; that of the whole body never is."""
        far = np.abs(np.asarray(shape_params) / np.asarray(self.spread)) > USUAL
        return [name for name, is_far in zip(self.names[1:], far[1:], strict=True) if is_far]

    def penalty(self, shape_params: Float[Array, "shape"]) -> Float[Array, ""]:
        """How unusual a shape is: squared expected deviations, of which those beyond what is usual count far more."""
        deviations = shape_params / self.spread
        beyond = jnp.maximum(jnp.abs(deviations[1:]) - USUAL, 0.0)
        return jnp.sum(deviations**2) + BEYOND * jnp.sum(beyond**2)

    def shaped(self, shape_params: Float[Array, "shape"]) -> Body:
        """The body with its lengths and sizes scaled."""
        factors = lambda groups: jnp.exp(groups @ shape_params)
        body = self.body
        return eqx.tree_at(
            lambda b: (b.skeleton.offsets, b.blobs.offsets, b.blob_sigmas, b.landmarks.offsets),
            body,
            (
                body.skeleton.offsets * factors(self.joint_groups)[:, None],
                body.blobs.offsets * factors(self.blob_groups)[:, None],
                body.blob_sigmas * factors(self.sigma_groups),
                body.landmarks.offsets * factors(self.landmark_groups)[:, None],
            ),
        )


def _spread(group: ShapeGroup, body: Body) -> float:
    """Expected deviation of a group's scale factor from the whole body's (logarithm)."""
    if group.joint_offsets:
        return LENGTH_SPREAD
    joints = dict(zip(body.landmarks.names, body.landmarks.joints, strict=True))
    at = [joints[name] for name in group.landmark_offsets]
    ends = bool(at) and not np.isin(at, body.skeleton.parents).any()
    return END_SPREAD if ends else SIZE_SPREAD


def _untied(groups: Sequence[ShapeGroup]) -> list[ShapeGroup]:
    """The groups with what is named `left_...` and `right_...` apart; what is named neither stays with both."""
    lists = [field.name for field in fields(ShapeGroup) if field.name != "name"]
    parts: list[ShapeGroup] = []
    for group in groups:
        sides = {
            side: {key: tuple(n for n in getattr(group, key) if n.startswith(side)) for key in lists}
            for side in ("left_", "right_")
        }
        members = [name for key in lists for name in getattr(group, key)]
        if all(name.startswith(("left_", "right_")) for name in members):
            parts += [
                ShapeGroup(f"{side}{group.name}", **of_side) for side, of_side in sides.items() if any(of_side.values())
            ]
        else:
            parts.append(group)
    return parts
