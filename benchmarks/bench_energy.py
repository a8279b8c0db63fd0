"""The energy's costs under pytest-benchmark.

pip install -e '.[bench]' && pytest -o addopts= benchmarks/bench_energy.py
"""

import equinox as eqx
import jax
import pytest
from energies import frame_energy, human, quadratic, value, value_and_gradient, with_near_pairs
from gradient import Settings, scattered_views

FUNCTIONS = {"value": value, "value and gradient": value_and_gradient, "quadratic model": quadratic}


@pytest.fixture(scope="module")
def objectives():
    body = human()
    dense = frame_energy(body, scattered_views(body, Settings()))
    return {"all pairs": dense, "near pairs": with_near_pairs(dense)}


@pytest.mark.parametrize("pairs", ["all pairs", "near pairs"])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_energy(benchmark, objectives, name, pairs):
    compiled = eqx.filter_jit(FUNCTIONS[name])
    objective = objectives[pairs]
    pose = objective.body.poses["rest"]
    jax.block_until_ready(compiled(objective, pose))
    benchmark(lambda: jax.block_until_ready(compiled(objective, pose)))
