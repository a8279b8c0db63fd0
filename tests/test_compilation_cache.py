"""Compiled programs are kept, apart for each jaxlib and processor, where they are taken back; or not, if asked."""

import os
import subprocess
import sys
import warnings
from importlib.metadata import version

import pytest
from full_disk import files_of_at_most

from sogjax.errors import InputError
from sogjax.run.compilation_cache import REFUSED, TRIED, VARIABLE, complaints, forget_unread, use_compilation_cache
from sogjax.run.compile_once import LOCKS

NOT_OF_THIS_MACHINE = (
    "Loading XLA:CPU AOT result. Target machine feature +prefer-no-scatter is not supported on the host machine."
)
PROGRAM = """
import jax
from jax._src import monitoring
from sogjax.run.compilation_cache import use_compilation_cache
hits = []
use_compilation_cache()
monitoring.register_event_listener(lambda event, **_: hits.append(event) if event.endswith("cache_hits") else None)
jax.jit(lambda x: x * 2.0 + 1.0)(1.0).block_until_ready()
print(len(hits))
"""


def hits(environment):
    """How many programs of a new process were taken from the cache."""
    surroundings = {k: v for k, v in os.environ.items() if not k.startswith("JAX_COMPILATION_CACHE")} | environment
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=surroundings, capture_output=True, text=True, check=True)
    assert not done.stderr
    return int(done.stdout)


@pytest.mark.slow
def test_a_second_process_finds_the_programs_of_the_first(tmp_path):
    assert hits({VARIABLE: str(tmp_path / "kept")}) == 0
    (folder,) = (path for path in (tmp_path / "kept").iterdir() if path.is_dir())
    assert folder.name.startswith(f"jaxlib-{version('jaxlib')}-")
    assert (folder / TRIED).exists()
    assert hits({VARIABLE: str(tmp_path / "kept")}) >= 1


@pytest.mark.slow
def test_they_lie_in_the_cache_folder_by_default(tmp_path):
    surroundings = {VARIABLE: "", "SOGJAX_CACHE": str(tmp_path)}
    hits(surroundings)
    assert hits(surroundings) >= 1
    assert list((tmp_path / "programs").glob("*/*-cache"))


def test_nothing_is_kept_when_switched_off(tmp_path):
    assert hits({VARIABLE: "off", "SOGJAX_CACHE": str(tmp_path)}) == 0
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_work_goes_on_where_kept_programs_are_not_taken(tmp_path):
    kept = tmp_path / "kept"
    hits({VARIABLE: str(kept)})
    (tried,) = kept.glob(f"*/{TRIED}")
    tried.rename(tried.with_name(REFUSED)).write_text(NOT_OF_THIS_MACHINE)
    assert hits({VARIABLE: str(kept)}) == 0


@pytest.mark.slow
@pytest.mark.parametrize("room", [0, 64])
def test_one_start_on_a_full_disk_does_not_switch_it_off_for_good(tmp_path, room):
    kept = tmp_path / "kept"
    with files_of_at_most(room):
        assert hits({VARIABLE: str(kept)}) == 0
    assert {path.name for path in kept.glob("*/*")} <= {LOCKS}
    hits({VARIABLE: str(kept)})
    assert hits({VARIABLE: str(kept)}) >= 1


@pytest.mark.slow
def test_a_refusal_that_does_not_speak_of_the_machine_counts_for_nothing(tmp_path):
    kept = tmp_path / "kept"
    hits({VARIABLE: str(kept)})
    (tried,) = kept.glob(f"*/{TRIED}")
    tried.rename(tried.with_name(REFUSED))
    hits({VARIABLE: str(kept)})
    assert hits({VARIABLE: str(kept)}) >= 1


@pytest.mark.slow
@pytest.mark.parametrize("size", [0, 50])
def test_a_damaged_program_is_compiled_again_and_kept_again(tmp_path, size):
    kept = tmp_path / "kept"
    hits({VARIABLE: str(kept)})
    for program in kept.glob("*/*-cache"):
        program.write_bytes(program.read_bytes()[:size])
    assert hits({VARIABLE: str(kept)}) == 0  # and nothing is said, which `hits` sees to
    assert hits({VARIABLE: str(kept)}) >= 1


def test_only_programs_of_the_name_that_cannot_be_read_are_deleted(tmp_path):
    names = ("jit_step-0a-cache", "jit_step-1b-cache", "jit_steps-0a-cache", "jit_step-0a-atime", TRIED)
    for name in names:
        (tmp_path / name).touch()
    with warnings.catch_warnings(record=True) as others:
        warnings.simplefilter("always")
        for _ in range(2):
            forget_unread(tmp_path)
        warnings.warn("Error reading persistent compilation cache entry for 'jit_step': OSError: no", stacklevel=1)
        warnings.warn("something else", stacklevel=1)
    assert [str(each.message) for each in others] == ["something else"]
    assert {path.name for path in tmp_path.iterdir()} == {*names[2:]}


def test_a_complaint_about_the_machine_is_noticed(monkeypatch):
    def complaining(function):
        os.write(2, f"{NOT_OF_THIS_MACHINE}\n".encode())
        return lambda x: x

    monkeypatch.setattr("jax.jit", complaining)
    assert NOT_OF_THIS_MACHINE in complaints()


def test_a_default_folder_that_cannot_be_made_is_no_error(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.setenv("SOGJAX_CACHE", str(tmp_path / "file"))
    use_compilation_cache()


def test_a_folder_that_cannot_be_made_is_refused(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file" / "kept"))
    with pytest.raises(InputError, match=VARIABLE):
        use_compilation_cache()
