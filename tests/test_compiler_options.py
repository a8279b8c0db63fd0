"""How XLA compiles is ours, unless somebody names one or another device may be used."""

import os
import subprocess
import sys

import pytest

from sogjax.run import compilation_cache as compiler_options
from sogjax.run.compilation_cache import COMPILER_VARIABLE, use_compiler_options


@pytest.fixture(autouse=True)
def flags_as_before(monkeypatch):
    monkeypatch.setenv(COMPILER_VARIABLE, "")
    monkeypatch.setattr(compiler_options, "entry_points", lambda group: ())


OPTIONS = compiler_options.COMPILER_OPTIONS


def test_the_options_are_set_once_beside_others(monkeypatch):
    monkeypatch.setattr(compiler_options, "version", lambda package: "0.10.2")
    monkeypatch.setenv(COMPILER_VARIABLE, "--xla_dump_to=there")
    ours = " ".join(f"{option}={value}" for option, value in OPTIONS.items())
    for _ in range(2):
        use_compiler_options()
        assert compiler_options.os.environ[COMPILER_VARIABLE] == f"--xla_dump_to=there {ours}"


def test_the_jaxlib_that_is_installed_knows_the_options_that_it_is_given(tmp_path):
    use_compiler_options()
    given = {**os.environ, "JAX_PLATFORMS": "cpu"}
    assert given[COMPILER_VARIABLE]
    ran = subprocess.run([sys.executable, "-c", "import jax; jax.devices()"], env=given, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr


def test_a_level_that_somebody_names_stays(monkeypatch):
    monkeypatch.setenv(COMPILER_VARIABLE, "--xla_backend_optimization_level=3")
    use_compiler_options()
    chosen = compiler_options.os.environ[COMPILER_VARIABLE].split()
    assert [option for option in chosen if "level" in option] == ["--xla_backend_optimization_level=3"]


def test_another_jaxlib_is_told_the_level_alone(monkeypatch):
    monkeypatch.setattr(compiler_options, "version", lambda package: "9.0.0")
    use_compiler_options()
    assert compiler_options.os.environ[COMPILER_VARIABLE] == "--xla_backend_optimization_level=1"


def test_nothing_is_changed_where_another_device_may_be_used(monkeypatch):
    monkeypatch.setattr(compiler_options, "entry_points", lambda group: ("cuda",))
    use_compiler_options()
    assert compiler_options.os.environ[COMPILER_VARIABLE] == ""
