"""Derivatives through a solve, by the implicit function theorem at the optimum.

At an optimum the gradient of the objective is 0, and it stays 0 when the objective changes a little: so the optimum
moves by `dp = A^-1 d(gradient)`, where A is the true curvature (minus the Hessian) and d(gradient) is how the gradient
at the optimum changes with the objective. No iteration of a solver is differentiated, and how the optimum was found
does not matter.

What is held fixed is what is fixed in the objective: of a tracked frame the quad-tree and the choice of image blobs,
the lists of near pairs, and the two poses before. The theorem wants an objective that is smooth at the optimum: where
an image blob lies exactly at its cap (Eq. 8), or a joint at the end of its range, the derivative is that of one side.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PyTree

from sogjax.solve.solution import Objective, Params, Scales

LEAST = 1e-6
"""Share of the largest curvature (in units of the parameters' steps); a direction that bends less is not determined."""


class Optimum(eqx.Module):
    """What the derivatives at an optimum rest on, to be looked at before they are believed."""

    slope: Float[Array, ""]
    """What the objective would still gain by a step of the largest size, to first order; 0 at an optimum."""
    curvatures: Params
    """How the objective bends along the principal directions, in units of the largest steps; rising."""
    directions: Float[Array, "param direction"]
    """Columns: the principal directions, in units of the largest steps."""
    determined: Bool[Array, "direction"]
    """Whether the objective bends downwards along a direction; along the others the parameters are held fixed."""

    @classmethod
    def at(cls, objective: Objective, params: Params, scales: Scales, least: float = LEAST) -> "Optimum":
        """The account of an objective at some parameters, which a solver found."""
        bounds = scales.step_bounds.astype(params.dtype)
        gradient, hessian = jax.grad(objective)(params), jax.jacfwd(jax.grad(objective))(params)
        curvatures, directions = jnp.linalg.eigh(-hessian * bounds[:, None] * bounds[None, :])
        enough = curvatures > least * jnp.max(jnp.abs(curvatures))
        return cls(jnp.linalg.norm(gradient * bounds), curvatures, directions, enough)

    def moved_by(self, gradient_rate: Params, bounds: Params) -> Params:
        """How the optimum moves where the gradient changes at a rate; along undetermined directions it stays."""
        safe = jnp.where(self.determined, self.curvatures, 1.0)
        along = jnp.matmul(self.directions.T, gradient_rate * bounds, precision="highest")
        moved = jnp.where(self.determined, along / safe, 0.0)
        return bounds * jnp.matmul(self.directions, moved, precision="highest")


def implicit_optimum(objective: PyTree, params: Params, scales: Scales, least: float = LEAST) -> Params:
    """The parameters a solver found, unchanged, but as a function of every array that the objective holds.

    `jax.grad`, `jax.jvp` and the like then give derivatives of the optimum by those arrays, in forward and reverse
    mode: for a `FrameEnergy` by bone lengths (`body.skeleton.offsets`), sizes, offsets and colours of blobs, weights of
    terms and cameras.

    Args:
        objective: an `equinox.Module` that is called with parameters, such as a `FrameEnergy`.
        params: where a solver found its maximum; the smaller its tolerance, the better the derivatives.
        scales: in whose largest steps curvatures are measured, so that angles and lengths are alike.
        least: the least curvature, as a part of the largest, of a direction that counts as determined. Along the others
            the derivative is 0: nothing in the objective says where the optimum goes (see `Optimum.determined`).
    """
    return _optimum(objective, params, scales, least)


@eqx.filter_custom_jvp
def _optimum(objective, params, scales, least):
    return params


@_optimum.def_jvp
def _optimum_rate(primals, tangents):
    objective, params, scales, least = primals
    rates = tangents[0]
    params = jax.lax.stop_gradient(params)
    if all(rate is None for rate in jax.tree.leaves(rates, is_leaf=lambda leaf: leaf is None)):
        return params, jnp.zeros_like(params)
    changing = jax.tree.map(lambda rate: rate is not None, rates, is_leaf=lambda leaf: leaf is None)
    moving, fixed = eqx.partition(objective, changing)
    slope = lambda moving: jax.grad(lambda p: eqx.combine(moving, fixed)(p))(params)
    gradient_rate = jax.jvp(slope, (moving,), (rates,))[1]
    bounds = scales.step_bounds.astype(params.dtype)
    return params, Optimum.at(objective, params, scales, least).moved_by(gradient_rate, bounds)
