"""Points that are spread over many."""

import numpy as np
import pytest

from sogjax.model.farthest import farthest


@pytest.mark.parametrize(
    ("count", "chosen"), [(1, [0]), (2, [0, 3]), (3, [0, 1, 3]), (4, [0, 1, 2, 3]), (9, [0, 1, 2, 3])]
)
def test_the_ends_come_before_what_is_between(count, chosen):
    points = np.array([[0.0, 0.0], [4.0, 0.0], [5.0, 0.0], [9.0, 0.0]])
    assert farthest(points, count).tolist() == chosen


def test_the_same_point_is_not_taken_twice():
    assert farthest(np.array([[0.0], [0.0], [1.0], [0.0]]), 3).tolist() == [0, 2]
