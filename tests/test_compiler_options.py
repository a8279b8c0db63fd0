"""The level at which XLA optimises is ours, unless somebody names one or another device may be used."""

import pytest

from sogjax.run import compilation_cache as compiler_options
from sogjax.run.compilation_cache import COMPILER_VARIABLE, use_compiler_options


@pytest.fixture(autouse=True)
def flags_as_before(monkeypatch):
    monkeypatch.setenv(COMPILER_VARIABLE, "")
    monkeypatch.setattr(compiler_options, "entry_points", lambda group: ())


def test_the_level_is_set_once_beside_other_flags(monkeypatch):
    monkeypatch.setenv(COMPILER_VARIABLE, "--xla_dump_to=there")
    for _ in range(2):
        use_compiler_options()
        assert (
            compiler_options.os.environ[COMPILER_VARIABLE] == "--xla_dump_to=there --xla_backend_optimization_level=1"
        )


def test_a_level_that_somebody_names_stays(monkeypatch):
    monkeypatch.setenv(COMPILER_VARIABLE, "--xla_backend_optimization_level=3")
    use_compiler_options()
    assert compiler_options.os.environ[COMPILER_VARIABLE] == "--xla_backend_optimization_level=3"


def test_nothing_is_changed_where_another_device_may_be_used(monkeypatch):
    monkeypatch.setattr(compiler_options, "entry_points", lambda group: ("cuda",))
    use_compiler_options()
    assert compiler_options.os.environ[COMPILER_VARIABLE] == ""
