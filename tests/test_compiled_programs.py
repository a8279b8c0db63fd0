"""Compiled programs are forgotten before the process has too many memory maps."""

import sys

import jax
import jax.numpy as jnp
import pytest

from sogjax.run.memory import forget_programs_if_many


@pytest.fixture
def limits(tmp_path):
    def written(used, allowed):
        (tmp_path / "maps").write_text("a map\n" * used)
        (tmp_path / "most").write_text(f"{allowed}\n")
        return tmp_path / "maps", tmp_path / "most"

    return written


@pytest.mark.slow
def test_programs_are_kept_while_there_is_room_and_forgotten_when_there_is_not(limits):
    compiled = []
    double = jax.jit(lambda x: compiled.append(1) or 2.0 * x)
    double(jnp.ones(3))
    assert not forget_programs_if_many(*limits(10, 1000))
    double(jnp.ones(3))
    assert len(compiled) == 1
    assert forget_programs_if_many(*limits(900, 1000))
    double(jnp.ones(3))
    assert len(compiled) == 2
    assert not forget_programs_if_many(*limits(200, 1000), memory=0.05)
    assert forget_programs_if_many(*limits(200, 1000), memory=0.5)


def test_nothing_is_done_where_the_system_does_not_tell(tmp_path):
    assert not forget_programs_if_many(tmp_path / "maps", tmp_path / "most")


@pytest.mark.skipif(sys.platform != "linux", reason="reads what Linux tells of a process")
def test_the_maps_of_this_process_can_be_counted(limits):
    _, plenty = limits(0, 10**9)
    assert not forget_programs_if_many(most=plenty)
