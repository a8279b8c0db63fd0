"""Parameters whose first value is tried in every run of the tests, the others in the slow ones."""

import pytest


def fast_and_slow(fast, *slow):
    """Values of a parameter (tuples: of several), all but the first left to the slow tests."""
    parts = lambda value: value if isinstance(value, tuple) else (value,)
    return [fast, *(pytest.param(*parts(value), marks=pytest.mark.slow) for value in slow)]
