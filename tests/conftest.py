"""Strict shapes and dtypes in every test: jaxtyping and beartype over the package, no silent promotion."""

import logging
import os
from pathlib import Path

os.environ.setdefault("JAX_PLATFORMS", "cpu")
# Most of the tests' time is compilation, a third of it optimisation, which the demo of `.ci/run` has.
os.environ.setdefault("JAX_DISABLE_MOST_OPTIMIZATIONS", "true")
os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=1")
# Both workers use what either compiled, and so does the next run.
os.environ.setdefault("SOGJAX_COMPILATION_CACHE", str(Path(__file__).parent.parent / ".pytest_cache" / "programs"))
os.environ.setdefault("SOGJAX_BACKGROUND_CACHE", "off")

import jax
import pytest
from jaxtyping import install_import_hook

install_import_hook("sogjax", "beartype.beartype")
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

from sogjax.run.compilation_cache import use_compilation_cache  # noqa: E402  (after the hook)

use_compilation_cache()


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
