"""Strict shapes and dtypes in every test: jaxtyping and beartype over the package, no silent promotion."""

import logging
import os
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
import xdist

CACHE = Path(__file__).parent.parent / ".pytest_cache"
# Most of the tests' time is compilation: without what makes programs faster, for the demo of `.ci/run` has that, and
# in one piece, as a piece for each core costs more.
FLAGS = ["backend_optimization_level=1"]
if version("jaxlib").startswith(("0.10.", "0.11.")):  # XLA ends the process at a flag that it does not know
    FLAGS.append("cpu_parallel_codegen_split_count=1")
if version("jaxlib").startswith("0.10."):
    FLAGS.append("cpu_use_fusion_emitters=false")

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "true")
os.environ.setdefault("XLA_FLAGS", " ".join(f"--xla_{flag}" for flag in FLAGS))
# Both workers use what either compiled, and so does the next run.
os.environ.setdefault("SOGJAX_COMPILATION_CACHE", str(CACHE / "programs"))
os.environ.setdefault("SOGJAX_BACKGROUND_CACHE", "off")
if sys.dont_write_bytecode:  # else both workers and every command that a test starts read all modules anew
    sys.dont_write_bytecode, sys.pycache_prefix = False, str(CACHE / "bytecode")
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix


def pytest_sessionstart(session):
    """Before the tests are imported; not in the process that only hands them out to others."""
    if not xdist.is_xdist_controller(session):
        be_strict()


def be_strict():
    """Check what is passed to and returned from every function of the package."""
    import jax
    from jaxtyping import install_import_hook

    install_import_hook("sogjax", "beartype.beartype")
    jax.config.update("jax_numpy_rank_promotion", "raise")
    jax.config.update("jax_numpy_dtype_promotion", "strict")

    from sogjax.run import kept_programs  # after the hook
    from sogjax.run.compilation_cache import use_compilation_cache

    use_compilation_cache()
    kept_programs.hold_programs = lambda: None  # types are checked while functions are traced


@pytest.fixture(scope="session")
def walking_dog():
    """A clip of a dog: its tracker, its cells, and what was found in them; see `walking_dog.py`."""
    from walking_dog import walking

    return walking()


@pytest.fixture
def plain_logging():
    """Hydra sets up logging for a sweep; put it back, so that no file stays open."""
    root = logging.getLogger()
    before = list(root.handlers)
    yield
    for handler in [h for h in root.handlers if h not in before]:
        root.removeHandler(handler)
        handler.close()
