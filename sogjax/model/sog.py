"""Sums of Gaussians (Eq. 2, 3): one padded pytree for images (2-D) and bodies (3-D)."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


class Sog(eqx.Module):
    """A sum of un-normalised isotropic Gaussians ("blobs"), padded to a fixed capacity.

    2-D: pixels, (0, 0) is the centre of the first pixel. 3-D: metres, in the world frame.
    """

    means: Float[Array, "*batch capacity dim"]
    sigmas: Float[Array, "*batch capacity"]
    colors: Float[Array, "*batch capacity channel"]
    mask: Bool[Array, "*batch capacity"]

    @property
    def capacity(self) -> int:
        """Number of slots, real ones and padding."""
        return self.sigmas.shape[-1]

    @classmethod
    def from_arrays(
        cls,
        means: Float[Array, "n dim"],
        sigmas: Float[Array, "n"],
        colors: Float[Array, "n channel"],
        capacity: int | None = None,
    ) -> "Sog":
        """Make a Sog of `n` real blobs, padded to `capacity` (default: no padding).

        Raises:
            ValueError: more blobs than capacity.
        """
        n = sigmas.shape[0]
        capacity = n if capacity is None else capacity
        if n > capacity:
            raise ValueError(f"{n} blobs do not fit into a capacity of {capacity}; raise the capacity")
        pad = capacity - n
        return cls(
            means=jnp.pad(means, ((0, pad), (0, 0))),
            sigmas=jnp.pad(sigmas, (0, pad), constant_values=1.0),
            colors=jnp.pad(colors, ((0, pad), (0, 0))),
            mask=jnp.arange(capacity) < n,
        )
