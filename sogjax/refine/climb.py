"""Climbing the energy of a clip: damped Gauss-Newton steps of all poses and the shape together."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sogjax.refine.arrow import ArrowSystem
from sogjax.refine.clip_energy import ClipEnergy

ROUNDS = 4
"""How often the pairs of blobs are found again, at most."""
ITERATIONS = 25
"""Iterations of a round."""
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 0.1, 1e-3, 1e4
COMMON = 3.0
"""Damping of every degree of freedom by the mean curvature, beside that by its own, as the tracker has it."""
CHANGE = 4.0
"""Factor of the damping after a step that was taken, or was not."""
SMALL_GAIN = 1e-5
"""Part of the energy below which another step is not worth its time."""
ROUND_GAIN = 1e-4
"""The gain from which on another round is worth it."""
HELD = 1e9
"""Damping of poses that stay as they are, in units of their own."""


@dataclass(frozen=True)
class Climbed:
    """Where a climb ended."""

    poses: Float[np.ndarray, "frame dof"]
    params: Float[np.ndarray, "shared"]
    before: float
    """The energy of the clip."""
    after: float
    """Never less."""
    iterations: int
    values: dict[str, Float[np.ndarray, "frame"]]
    """Values of the terms of tracking in every frame, at the end."""
    capacity: int
    """Capacity for image blobs of a picture."""


def climbed(
    energy: ClipEnergy,
    poses: Float[np.ndarray, "frame dof"],
    params: Float[np.ndarray, "shared"],
    free: Bool[np.ndarray, "shared"],
    held: Bool[np.ndarray, "frame"] | None = None,
    tracked: tuple[Float[np.ndarray, "frame dof"], Float[np.ndarray, "shared"]] | None = None,
) -> Climbed:
    """The poses and the shape of highest energy near a start; only steps that raise it are taken.

    `free` marks the shared parameters that may change, `held` the frames whose poses stay; `tracked` are the poses and
    parameters whose energy is that before (None: those at the start).
    """
    held = np.zeros(len(poses), bool) if held is None else held
    poses, params, iterations = np.array(poses, float), np.array(params, float), 0
    before, value = None, 0.0
    for _ in range(ROUNDS):
        if before is None:
            first = tracked or (poses, params)
            energy = energy.near(*first)
            before = energy.model(*first)[0]
        energy = energy.near(poses, params)
        end = _Climb(energy, poses, params, free, held).run()
        poses, params, value, iterations = end.poses, end.params, end.value, iterations + end.iterations
        if end.settled:
            break
    values, capacity = energy.near(poses, params).values(poses, params), energy.pictures.views.images.capacity
    return Climbed(poses, params, before or 0.0, value, iterations, values, capacity)


@dataclass
class _State:
    """Where a round is."""

    poses: Float[np.ndarray, "frame dof"]
    params: Float[np.ndarray, "shared"]
    value: float
    system: ArrowSystem
    scale: Float[np.ndarray, "frame dof"]
    """Curvatures by which damping is measured."""
    shared_scale: Float[np.ndarray, "shared"]
    damping: float = FIRST_DAMPING
    iterations: int = 0
    settled: bool = False


class _Climb:
    """A round: steps for which one list of pairs holds."""

    def __init__(
        self,
        energy: ClipEnergy,
        poses: Float[np.ndarray, "frame dof"],
        params: Float[np.ndarray, "shared"],
        free: Bool[np.ndarray, "shared"],
        held: Bool[np.ndarray, "frame"],
    ):
        self._energy, self._free, self._held = energy, free, held
        self._bounds = np.asarray(energy.tracker.scales.step_bounds, float)
        self._shared_bounds = energy.largest_steps[free]
        self._start = (poses, params)
        value, system, scale = energy.model(poses, params)
        self.first = value
        self._state = _State(poses, params, value, system, *scale)

    def run(self) -> _State:
        """Steps until they gain little, or lead too far away for the pairs."""
        state = self._state
        while state.iterations < ITERATIONS and state.damping < MOST_DAMPING:
            state.iterations += 1
            gain = self._step(state)
            if gain is None:
                state.damping *= CHANGE
                continue
            state.damping = max(state.damping / CHANGE, LEAST_DAMPING)
            if self._energy.moved(self._start, (state.poses, state.params)) > 1.0:
                return state
            if gain < SMALL_GAIN * abs(state.value):
                break
        state.settled = state.value - self.first < ROUND_GAIN * abs(state.value)
        return state

    def _step(self, state: _State) -> float | None:
        """Take a step if it raises the energy, and say by how much."""
        tried = self._damped(state.system, state.damping)
        if tried is None:
            return None
        poses, params = state.poses + tried[0], state.params + tried[1]
        value, system, _ = self._energy.model(poses, params)
        if not (np.isfinite(value) and value > state.value):
            return None
        gain = value - state.value
        state.poses, state.params, state.value, state.system = poses, params, value, system
        return gain

    def _damped(self, system: ArrowSystem, damping: float) -> tuple[np.ndarray, np.ndarray] | None:
        """The step of the damped model, shortened as a whole where a part of it exceeds its bound."""
        own = self._state.scale * self._bounds**2
        held = damping * (own + COMMON * own.mean(axis=1, keepdims=True))
        held[self._held] = HELD * np.maximum(own[self._held], own.mean())
        found = system.restricted(self._free).step(
            held / self._bounds**2, damping * self._state.shared_scale[self._free]
        )
        if found is None:
            return None
        poses, shared = found
        largest = max(np.abs(poses / self._bounds).max(), np.abs(shared / self._shared_bounds).max(initial=0.0), 1.0)
        poses[self._held] = 0.0
        params = np.zeros(len(self._free))
        params[self._free] = shared
        return poses / largest, params / largest
