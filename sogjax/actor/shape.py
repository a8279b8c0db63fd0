"""Shape parameters: the lengths and sizes of a body that are scaled together (Section 5.2)."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.model.body import Body


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

    @classmethod
    def from_body(cls, body: Body) -> "ShapeModel":
        """Read the groups of a body."""
        groups = body.shape_groups

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
        )

    @property
    def num_shape_params(self) -> int:
        """One for the whole body and one for each group."""
        return self.joint_groups.shape[1]

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
