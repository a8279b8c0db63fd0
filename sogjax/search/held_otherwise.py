"""Other ways to hold the limbs of a body in one frame: many are compared, the best different ones climbed.

The rest of the body is held meanwhile (`energy/part_energy.py`).
"""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.part_energy import PartEnergy
from sogjax.energy.views import Views
from sogjax.model.batches import of_each
from sogjax.model.program import compiled
from sogjax.search.limb_ways import CROSSED, UnitArrays, look_alikes
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.tracking.tracker import Tracker

NUM_CLIMBED = 8
"""Different ways that are climbed, the tracked one among them. For each limb one more is, in which it is elsewhere."""
ELSEWHERE = 0.17
"""Metres, mean over the outer blobs of a limb, from where it was tracked: then it is climbed as one that is elsewhere;
a climb may lead back a little."""
ITERATIONS = 12
APART = 0.08
"""Metres, mean over the blobs of the limb that differs more: ways to hold a unit that count as different."""
LARGEST_ANGLE = 0.3
"""Radians: bound on a step of a climb."""


class HeldOtherwise(eqx.Module):
    """Ways to hold a unit, or all, climbed from where they were and elsewhere; the rest is as it was tracked."""

    poses: Float[Array, "*unit way dof"]
    gains: Float[Array, "*unit way"]
    """The energy above that of the tracked pose."""
    apart: Float[Array, "*unit way"]
    """Metres from the tracked pose: mean over the blobs of the limb that differs more."""
    crossed: Float[Array, "*unit dof"]
    """With the ends of its limbs exchanged, not climbed."""
    crossed_gains: Float[Array, "*unit"]
    """As `gains`, of that."""
    crossed_apart: Float[Array, "*unit"]
    """As `apart`, of that."""


@compiled
def held_otherwise(
    tracker: Tracker, views: Views, pose: Float[Array, "dof"], unit: UnitArrays, tried: Float[Array, "seed dof"]
) -> HeldOtherwise:
    """The best different ways to hold a unit in what is seen, climbed.

    Compared are the tracked one, those that look like it, and those that are `tried`.
    """
    scales = replace(tracker.scales, largest_steps=jnp.maximum(tracker.scales.largest_steps, LARGEST_ANGLE))
    solver, index, limbs = GaussNewton(max_iterations=ITERATIONS), unit.index, unit.limbs
    energy = PartEnergy.around(tracker.body, views, tracker.terms, pose, index)
    held = lambda params: index.put(pose, params)
    means = lambda params: tracker.body.posed_blobs(held(params)).means[index.blobs]
    params = jax.vmap(index.params)(jnp.concatenate([pose[None], look_alikes(tracker.body, pose, unit), tried]))
    values = of_each(energy, params)
    chosen = _different(jax.vmap(means)(params), values, unit)
    climb = lambda start: solver.maximize(energy, start, replace(scales, kinds=scales.kinds[index.dofs]))
    found = of_each(climb, params[chosen])
    apart = jax.vmap(lambda each: _apart(each, means(params[0]), limbs))(jax.vmap(means)(found.params))
    ways = jax.vmap(held)(found.params), found.value - values[0], apart
    crossed = held(params[CROSSED]), values[CROSSED] - values[0]
    return HeldOtherwise(*ways, *crossed, _apart(means(params[CROSSED]), means(params[0]), limbs))


def _different(means: Float[Array, "seed slot 3"], values: Float[Array, "seed"], unit: UnitArrays) -> Int[Array, "way"]:
    """The first, and the best that lie apart from it and from each other; then the best with each limb elsewhere."""
    left, chosen = values, [jnp.asarray(0)]
    anywhere = [jnp.ones(len(means), bool)] * (NUM_CLIMBED - 1)
    moved = jnp.linalg.norm(means - means[:1], axis=-1)
    outside = jnp.where(unit.limbs, unit.outer[None], 0.0)
    elsewhere = moved @ outside.T > ELSEWHERE * jnp.sum(outside, axis=1)[None]
    elsewhere &= jnp.any(unit.limbs, axis=1)[None]
    for allowed in (*anywhere, *elsewhere.T):
        near = jax.vmap(lambda each: _apart(each, means[chosen[-1]], unit.limbs))(means) < APART
        left = jnp.where(near, -jnp.inf, left)
        chosen.append(jnp.argmax(jnp.where(allowed, left, -jnp.inf)))
    return jnp.stack(chosen)


def _apart(
    means: Float[Array, "slot 3"], others: Float[Array, "slot 3"], limbs: Bool[Array, "limb slot"]
) -> Float[Array, ""]:
    """Metres, mean over the blobs of the limb that is farther off."""
    moved = jnp.linalg.norm(means - others, axis=-1)
    sums = jnp.sum(jnp.where(limbs, moved[None], 0.0), axis=1)
    return jnp.max(sums / jnp.maximum(jnp.sum(limbs, axis=1, dtype=sums.dtype), 1.0))
