"""Parameters whose first value is tried in every run of the tests, the others in the slow ones."""

import pytest


def fast_and_slow(fast, *slow):
    """Values of a parameter, all but the first left to the slow tests."""
    return [fast, *(pytest.param(value, marks=pytest.mark.slow) for value in slow)]
