"""What the energy, its gradient and its curvature cost, and how that grows with what they are computed from."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from gradient import Settings, scattered_views
from quantities import Quantity, exponent, milliseconds

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.posed import History
from sogjax.energy.views import Views
from sogjax.io.actor_file import load_body, named_body
from sogjax.model.body import Body, concatenate
from sogjax.model.skeleton import Skeleton

AT_ONCE = 10
"""Evaluations in one compiled call, each at the pose that the one before it gave, so that none can be left out."""


def human() -> Body:
    """The body with 63 blobs and 43 degrees of freedom."""
    return load_body(named_body("human"))


def frame_energy(body: Body, views: Views, gradient: str = "forward") -> FrameEnergy:
    """Eq. 10 of a frame at the rest pose."""
    rest = body.poses["rest"]
    terms = standard_terms(gradient="forward" if gradient == "forward" else "autodiff")
    return FrameEnergy(body, views, History(rest, rest, jnp.asarray(True)), terms)


def with_near_pairs(objective: FrameEnergy) -> FrameEnergy:
    """The same with lists of near pairs made at the rest pose, with a quarter more room than they need."""
    rest, near = objective.body.poses["rest"], eqx.filter_jit(FrameEnergy.near)
    count = int(near(objective, rest, 1)[1])
    return near(objective, rest, int(1.25 * count) + 1)[0]


def value(objective: FrameEnergy, pose: jax.Array) -> jax.Array:
    """The energy."""
    return objective(pose)


def value_and_gradient(objective: FrameEnergy, pose: jax.Array) -> tuple[jax.Array, jax.Array]:
    """The energy and its gradient."""
    return jax.value_and_grad(objective)(pose)


def quadratic(objective: FrameEnergy, pose: jax.Array) -> tuple[jax.Array, ...]:
    """The energy with its gradient and curvature."""
    return tuple(jax.tree.leaves(objective.quadratic(pose)))


def forward_kinematics(objective: FrameEnergy, pose: jax.Array) -> jax.Array:
    """Where the blobs are."""
    return objective.body.posed_blobs(pose).means


def cost(function: Callable[[FrameEnergy, jax.Array], Any], objective: FrameEnergy, repeats: int = 8) -> float:
    """Milliseconds of one evaluation within a compiled program."""

    @eqx.filter_jit
    def evaluations(objective: FrameEnergy, pose: jax.Array) -> jax.Array:
        def again(_, pose: jax.Array) -> jax.Array:
            parts = jax.tree.leaves(function(objective, pose))
            return pose + 1e-20 * sum(jnp.sum(part) for part in parts)

        return jax.lax.fori_loop(0, AT_ONCE, again, pose)

    return milliseconds(evaluations, objective, objective.body.poses["rest"], repeats=repeats) / AT_ONCE


def energy_quantities() -> Iterator[Quantity]:
    """Value, gradient and curvature at 12 cameras with 1024 image blobs each, and the ratios that have targets."""
    body = human()
    views = scattered_views(body, Settings())
    dense = frame_energy(body, views)
    sparse = with_near_pairs(dense)
    value_dense, both_dense = cost(value, dense), cost(value_and_gradient, dense)
    autodiff = cost(value_and_gradient, frame_energy(body, views, "autodiff"))
    both_sparse = cost(value_and_gradient, sparse)
    for name, milli in (
        ("value, all pairs", value_dense),
        ("value and gradient, all pairs", both_dense),
        ("value and gradient, all pairs, plain reverse mode", autodiff),
        ("value, near pairs", cost(value, sparse)),
        ("value and gradient, near pairs", both_sparse),
        ("value, gradient and curvature, near pairs", cost(quadratic, sparse)),
        ("forward kinematics alone", cost(forward_kinematics, dense)),
    ):
        yield Quantity("energy", name, milli, "ms")
    yield Quantity("energy", "value and gradient, in values", both_dense / value_dense, "ratio", target=1.5)
    yield Quantity("energy", "plain reverse mode, in forward", autodiff / both_dense, "ratio", True, target=4.0)
    yield Quantity("energy", "all pairs, in near pairs", both_dense / both_sparse, "ratio", True, target=2.5)
    yield Quantity("energy", "relative difference of near pairs", difference(dense, sparse), "ratio", target=1e-4)


def difference(dense: FrameEnergy, sparse: FrameEnergy) -> float:
    """The larger of the relative differences of value and gradient."""
    at = dense.body.poses["rest"]
    expected, found = (eqx.filter_jit(value_and_gradient)(objective, at) for objective in (dense, sparse))
    gradients = np.asarray(expected[1]), np.asarray(found[1])
    of_gradient = np.linalg.norm(gradients[1] - gradients[0]) / np.linalg.norm(gradients[0])
    return max(float(of_gradient), abs(float(found[0]) / float(expected[0]) - 1.0))


def growth_quantities() -> Iterator[Quantity]:
    """With what power value and gradient (near pairs) grow with the numbers of cameras, blobs and actors."""
    body = human()
    near = lambda body, settings: cost(
        value_and_gradient, with_near_pairs(frame_energy(body, scattered(body, settings)))
    )
    scattered = scattered_views
    fits: dict[str, tuple[Sequence[int], list[float]]] = {
        "cameras": (sizes := (6, 12, 24), [near(body, Settings(cameras=n)) for n in sizes]),
        "image blobs": (sizes := (512, 1024, 2048), [near(body, Settings(image_blobs=n)) for n in sizes]),
        "body blobs": (sizes := (16, 32, 63), [near(with_blobs(body, n), Settings()) for n in sizes]),
        "actors": (sizes := (1, 2, 4), [near(crowd(body, n), Settings()) for n in sizes]),
    }
    for name, (sizes, costs) in fits.items():
        yield Quantity(
            "growth",
            f"exponent with {name}, {'/'.join(map(str, sizes))}",
            exponent(sizes, costs),
            "exponent",
            target=1.0,
        )


def with_blobs(body: Body, count: int) -> Body:
    """A body with some of its blobs only, spread over it."""
    kept = np.linspace(0, body.num_blobs - 1, count).round().astype(int)
    blobs = replace(
        body.blobs,
        names=tuple(body.blobs.names[k] for k in kept),
        joints=tuple(body.blobs.joints[k] for k in kept),
        offsets=body.blobs.offsets[kept],
    )
    return replace(body, blobs=blobs, blob_sigmas=body.blob_sigmas[kept], blob_colors=body.blob_colors[kept])


def crowd(body: Body, count: int) -> Body:
    """Several bodies as one, side by side a metre apart."""
    apart = [replace(body, name=f"{body.name}{k}", skeleton=moved(body, float(k))) for k in range(count)]
    return concatenate(apart)


def moved(body: Body, metres: float) -> Skeleton:
    """A body's skeleton with its root put aside."""
    offsets = body.skeleton.offsets
    return replace(body.skeleton, offsets=offsets.at[0, 1].add(metres))
