"""Compiled programs are kept only where a person asks for it, apart for each jaxlib and processor."""

import os
import subprocess
import sys
from importlib.metadata import version

import pytest

from sogjax.engine.compilation_cache import VARIABLE, use_compilation_cache
from sogjax.errors import InputError

PROGRAM = """
import jax
from jax._src import monitoring
from sogjax.engine.compilation_cache import use_compilation_cache
hits = []
monitoring.register_event_listener(lambda event, **_: hits.append(event) if event.endswith("cache_hits") else None)
use_compilation_cache()
jax.jit(lambda x: x * 2.0 + 1.0)(1.0).block_until_ready()
print(len(hits))
"""


def hits(environment):
    """How many programs of a new process were taken from the cache."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=os.environ | environment, capture_output=True, text=True, check=True
    )
    return int(done.stdout)


def test_a_second_process_finds_the_programs_of_the_first(tmp_path):
    assert hits({VARIABLE: str(tmp_path / "kept")}) == 0
    (folder,) = (tmp_path / "kept").iterdir()
    assert folder.name.startswith(f"jaxlib-{version('jaxlib')}-")
    assert hits({VARIABLE: str(tmp_path / "kept")}) >= 1


def test_nothing_is_kept_unasked(tmp_path):
    assert hits({VARIABLE: ""}) == 0
    assert list(tmp_path.iterdir()) == []


def test_a_folder_that_cannot_be_made_is_refused(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file" / "kept"))
    with pytest.raises(InputError, match=VARIABLE):
        use_compilation_cache()
