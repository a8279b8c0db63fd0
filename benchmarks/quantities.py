"""What one report measures: named numbers that know whether they may be compared between machines, and how."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np

Kind = Literal["ms", "frames/s", "s", "MiB", "mm", "ratio", "exponent", "count", "energy"]

ALLOWED: dict[str, float] = {"ms": 1.5, "s": 1.5, "frames/s": 1.5, "MiB": 1.15, "ratio": 1.3}
"""By what factor a quantity may be worse than the baseline's; times count in units of the reference workload."""
ADDED: dict[str, float] = {"mm": 1.0, "exponent": 0.25, "count": 3.0}
"""By how much one may be worse, where a factor would say nothing."""


@dataclass(frozen=True)
class Quantity:
    """A measured number. `larger_is_better` of a ratio such as a speed-up."""

    section: str
    name: str
    value: float
    kind: Kind
    larger_is_better: bool = False
    target: float | None = None
    """What it should be at most (or at least, where larger is better)."""

    @property
    def key(self) -> str:
        """Its name in JSON."""
        return f"{self.section}: {self.name}"

    @property
    def met(self) -> bool | None:
        """Whether the target is met; None if there is none."""
        if self.target is None or np.isnan(self.value):
            return None
        return self.value >= self.target if self.larger_is_better else self.value <= self.target

    def comparable(self, reference: float) -> float:
        """The number with the speed of the machine taken out; `reference` is the time of the reference workload, ms."""
        if self.kind in ("ms", "s"):
            return self.value / reference
        return self.value * reference if self.kind == "frames/s" else self.value


def is_worse(now: Quantity, before: float, reference_now: float, reference_before: float) -> bool:
    """Whether a quantity is worse than a baseline's value by more than its kind allows."""
    then = Quantity(now.section, now.name, before, now.kind).comparable(reference_before)
    value = now.comparable(reference_now)
    if now.larger_is_better:
        return then > ALLOWED.get(now.kind, np.inf) * value
    if now.kind in ADDED:
        return value > then + ADDED[now.kind]
    return value > ALLOWED.get(now.kind, np.inf) * then


def milliseconds(function: Callable[..., Any], *arguments: Any, repeats: int = 15) -> float:
    """The least time of a call, after one that compiles."""
    jax.block_until_ready(function(*arguments))
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        jax.block_until_ready(function(*arguments))
        times.append(time.perf_counter() - begin)
    return 1000.0 * min(times)


def reference_milliseconds() -> float:
    """Of the reference workload."""
    return milliseconds(reference_workload(), repeats=40)


def reference_workload() -> Callable[[], Any]:
    """Work that has nothing of this project in it: exponentials and a matrix product, about equal parts."""
    rng = np.random.default_rng(0)
    values, matrix = (jnp.asarray(rng.random(shape), jnp.float32) for shape in ((1_000_000,), (400, 400)))
    work = jax.jit(lambda values, matrix: (jnp.exp(-values), jnp.matmul(matrix, matrix, precision="highest")))
    return partial(work, values, matrix)


def exponent(sizes: Sequence[float], costs: Sequence[float]) -> float:
    """The power of the size with which the cost grows, fitted."""
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])
