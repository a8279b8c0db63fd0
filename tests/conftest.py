"""Strict shapes and dtypes in every test: jaxtyping and beartype over the package, no silent promotion."""

import logging
import os
import shutil
import tempfile

os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import pytest
from jaxtyping import install_import_hook

install_import_hook("sogjax", "beartype.beartype")
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

from sogjax.engine.compilation_cache import VARIABLE, use_compilation_cache  # noqa: E402 - behind the hook

OWN_PROGRAMS = VARIABLE not in os.environ
"""Whether compiled programs are kept for this session only: what one worker or command compiled, all others read."""


def pytest_configure():
    """The main process comes first; its workers get the folder with the environment."""
    if OWN_PROGRAMS:
        os.environ[VARIABLE] = tempfile.mkdtemp(prefix="sogjax_tests_")
    use_compilation_cache()


def pytest_unconfigure():
    if OWN_PROGRAMS:
        shutil.rmtree(os.environ.pop(VARIABLE), ignore_errors=True)


@pytest.fixture
def plain_logging():
    """Hydra sets up logging for a sweep; put it back, so that no file stays open."""
    root = logging.getLogger()
    before = list(root.handlers)
    yield
    for handler in [h for h in root.handlers if h not in before]:
        root.removeHandler(handler)
        handler.close()
