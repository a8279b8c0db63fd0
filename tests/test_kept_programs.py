"""Programs that are kept as they run: read instead of traced, told apart by all that they follow from."""

import os
import subprocess
import sys
from functools import partial
from inspect import unwrap
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from command_line import trackable

from sogjax.energy.priors import acceleration_penalty, limit_penalty
from sogjax.io.actor_file import save_body
from sogjax.model.color import from_rgb
from sogjax.model.program import compiled, keep_programs
from sogjax.model.skeleton import Skeleton
from sogjax.run import kept_programs
from sogjax.run.kept_programs import KeptPrograms
from sogjax.solve.solution import QuadraticModel


@pytest.fixture
def traced(monkeypatch):
    """The names of what was traced."""
    names = []
    lower = jax.jit

    def noting(function, **options):
        names.append(function)
        return lower(function, **options)

    monkeypatch.setattr(kept_programs.jax, "jit", noting)
    return names


def values(*shape):
    return jnp.linspace(0.1, 1.0, int(np.prod(shape)), dtype=jnp.float32).reshape(shape)


def ask(kept, function, *arguments, **options):
    """What a keeper computes; None: it does not hold the function."""
    program = kept.program(function, options, (arguments, {}))
    return program and program([jnp.asarray(leaf) for leaf in jax.tree.leaves(arguments) if eqx.is_array(leaf)])


def test_a_program_is_traced_once_and_read_by_others(tmp_path, traced):
    given = values(5), values(5) - 0.3, values(5) + 0.2
    first = ask(KeptPrograms(tmp_path), limit_penalty, *given)
    assert len(traced) == 1
    kept = KeptPrograms(tmp_path)  # as in the next process
    for _ in range(2):
        np.testing.assert_array_equal(ask(kept, limit_penalty, *given), first)
    assert len(traced) == 1
    np.testing.assert_allclose(first, limit_penalty(*given), rtol=1e-6)
    kept.forget()
    np.testing.assert_array_equal(ask(kept, limit_penalty, *given), first)
    assert len(traced) == 1


@pytest.mark.parametrize(
    "other",
    [
        (acceleration_penalty, (values(5), values(5), values(5)), {}),
        (limit_penalty, (values(6), values(6), values(6)), {}),
        (limit_penalty, (values(5), values(5), values(5).astype(jnp.float16)), {}),
        (limit_penalty, (values(5), values(5), values(5)), {"xla_backend_optimization_level": 0}),
        (from_rgb, (values(4, 3), "hsv_cone"), {}),
    ],
)
def test_another_function_shape_type_value_or_option_is_another_program(other, tmp_path, traced):
    kept = KeptPrograms(tmp_path)
    ask(kept, limit_penalty, values(5), values(5), values(5))
    ask(kept, from_rgb, values(4, 3), "rgb")
    with jax.numpy_dtype_promotion("standard"):
        ask(kept, other[0], *other[1], **other[2])
    assert len(traced) == 3


def test_other_files_settings_or_versions_are_other_programs(tmp_path, monkeypatch, traced):
    given = values(5), values(5), values(5)
    ask(KeptPrograms(tmp_path), limit_penalty, *given)
    with jax.numpy_rank_promotion("allow"):
        ask(KeptPrograms(tmp_path), limit_penalty, *given)
    monkeypatch.setenv("XLA_FLAGS", os.environ.get("XLA_FLAGS", "") + " ")
    ask(KeptPrograms(tmp_path), limit_penalty, *given)
    monkeypatch.setattr(kept_programs, "version", lambda name: "0.0.1")
    ask(KeptPrograms(tmp_path), limit_penalty, *given)
    assert len(traced) == 4


@pytest.mark.parametrize("damaged", [lambda content: content[:100], lambda c: c[:500] + bytes([c[500] ^ 1]) + c[501:]])
def test_a_damaged_file_is_compiled_again(damaged, tmp_path, traced):
    given = values(5), values(5), values(5)
    first = ask(KeptPrograms(tmp_path), limit_penalty, *given)
    for path in tmp_path.iterdir():
        path.write_bytes(damaged(path.read_bytes()))
    np.testing.assert_array_equal(ask(KeptPrograms(tmp_path), limit_penalty, *given), first)
    np.testing.assert_array_equal(ask(KeptPrograms(tmp_path), limit_penalty, *given), first)
    assert len(traced) == 2


def test_modules_go_in_and_come_out(tmp_path, traced):
    skeleton = shipped("human").skeleton
    pose = jnp.zeros(skeleton.num_dofs)
    one, two = (ask(KeptPrograms(tmp_path), Skeleton.world_from_joint, skeleton, pose) for _ in range(2))
    assert len(traced) == 1
    np.testing.assert_array_equal(one, two)
    model = QuadraticModel(jnp.asarray(1.0), jnp.ones(3), jnp.eye(3))
    found = [ask(KeptPrograms(tmp_path), QuadraticModel.__add__, model, model) for _ in range(2)]
    assert all(isinstance(each, QuadraticModel) for each in found)
    assert float(found[1].value) == 2.0
    assert len(traced) == 2


def test_nothing_is_kept_once_the_package_was_edited(tmp_path, monkeypatch):
    kept = KeptPrograms(tmp_path)
    files = kept_programs._files()
    monkeypatch.setattr(kept_programs, "_files", lambda: [(path, when + 1, size) for path, when, size in files])
    assert ask(kept, limit_penalty, values(5), values(5), values(5)) is not None
    assert [*tmp_path.iterdir()] == []


def calls_back(numbers):
    return jax.pure_callback(lambda given: np.asarray(given), jax.ShapeDtypeStruct((5,), jnp.float32), numbers)


def test_what_calls_back_into_python_is_left_to_jax(tmp_path, monkeypatch):
    monkeypatch.setattr(calls_back, "__module__", "sogjax.tests")
    assert ask(KeptPrograms(tmp_path), calls_back, values(5)) is None
    assert [*tmp_path.iterdir()] == []


def test_settings_that_change_meanwhile_are_other_programs(tmp_path, traced):
    kept = KeptPrograms(tmp_path)
    for precision in ("default", "highest", "default"):
        with jax.default_matmul_precision(precision):
            ask(kept, limit_penalty, values(5), values(5), values(5))
    assert len(traced) == 2


class Unknown(NamedTuple):
    """A class of a user's."""

    number: int


def test_what_is_not_of_the_package_is_not_kept(tmp_path):
    kept = KeptPrograms(tmp_path)
    assert ask(kept, test_modules_go_in_and_come_out) is None
    assert ask(kept, limit_penalty, values(5), values(5), Unknown(1)) is None
    assert ask(kept, limit_penalty, values(5), values(5), lambda: 1) is None
    assert [*tmp_path.iterdir()] == []


def test_a_keeper_is_asked_for_functions_of_modules_alone(traced):
    asked = []

    class Keeper:
        def program(self, function, options, given):
            asked.append(function)

        def forget(self):
            asked.clear()

    factor, of_module = 2.0, unwrap(limit_penalty)  # without the checks that tests add
    functions = [of_module, partial(limit_penalty, values(5)), lambda *a: factor * limit_penalty(*a)]
    keep_programs(Keeper())
    try:
        found = [compiled(each)(*[values(5)] * count) for each, count in zip(functions, (3, 2, 3), strict=True)]
    finally:
        keep_programs(None)
    assert asked == [of_module]
    assert float(found[0]) == float(found[1]) == float(found[2]) == 0.0


def test_programs_take_arrays_of_jax_as_they_are_and_others_converted():
    given = []

    class Keeper:
        def program(self, function, options, given_to):
            return given.extend

        def forget(self):
            """Hold nothing."""

    pose, limits = jnp.zeros(5), np.ones(5, np.float32)
    keep_programs(Keeper())
    try:
        compiled(unwrap(limit_penalty))(pose, limits, limits)
    finally:
        keep_programs(None)
    assert given[0] is pose
    assert len(given) == 3
    assert all(isinstance(each, jax.Array) for each in given)


SCRIPT = """
import sys
from pathlib import Path
from sogjax.run.compilation_cache import use_compilation_cache
use_compilation_cache()
import jax.numpy as jnp
from sogjax.run.compile_once import compile_once
compile_once()
from sogjax.run.kept_programs import KeptPrograms
from sogjax.solve.solution import QuadraticModel
model = QuadraticModel(jnp.asarray(1.0), jnp.ones(3), jnp.eye(3))
given = model, jnp.ones(3), jnp.asarray(0.0), jnp.ones(3)
program = KeptPrograms(Path(sys.argv[1])).program(QuadraticModel.step, {}, (given, {}))
print(program([model.value, model.gradient, model.curvature, *given[1:]]))
"""


@pytest.mark.slow
def test_another_process_reads_a_program_that_calls_lapack(tmp_path):
    told = os.environ | {"SOGJAX_COMPILATION_CACHE": str(tmp_path / "programs")}
    found = []
    for folder in ("one", "one", "two"):  # jax's own, too, was compiled for the last one
        (tmp_path / folder).mkdir(exist_ok=True)
        command = [sys.executable, "-c", SCRIPT, str(tmp_path / folder)]
        ran = subprocess.run(command, capture_output=True, text=True, env=told, check=False)
        assert ran.returncode == 0, ran.stderr
        found.append(ran.stdout)
    command = [sys.executable, "-c", SCRIPT, str(tmp_path / "two")]  # what was read of jax's was written whole
    found.append(subprocess.run(command, capture_output=True, text=True, env=told, check=True).stdout)
    assert len(set(found)) == 1
    assert len([*(tmp_path / "one").iterdir()]) == len([*(tmp_path / "two").iterdir()]) == 1


@pytest.mark.slow
def test_a_command_finds_the_same_again_and_traces_nothing_of_ours(tmp_path):
    told = os.environ | {
        "SOGJAX_CACHE": str(tmp_path / "cache"),
        "SOGJAX_COMPILATION_CACHE": str(tmp_path / "programs"),
    }
    recording, actor = trackable(tmp_path / "walk"), tmp_path / "human.yaml"
    save_body(actor, shipped("human"))
    words = [f"recording={recording}", f"actor={actor}", "outputs.overlay=false", "outputs.rerun=false"]
    motions, kept = [], []
    for name in ("one", "two"):
        command = [sys.executable, "-m", "sogjax", "track", *words, f"out={tmp_path / name}"]
        subprocess.run(command, check=True, env=told, capture_output=True)
        motions.append(dict(np.load(tmp_path / name / "motion.npz")))
        kept.append({path.name for path in (tmp_path / "programs").rglob("traced-*")})
    assert len(kept[0]) > 10
    assert kept[1] == kept[0]
    assert motions[0].keys() == motions[1].keys()
    for key, values in motions[0].items():
        np.testing.assert_array_equal(motions[1][key], values, err_msg=key)
