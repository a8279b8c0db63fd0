"""Frames of the videos as example poses: which are chosen, which way somebody faces, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from sogjax.actor.facing import consistent_ways, disagreement
from sogjax.actor.frame_choice import SHAPE_VOXELS, SeenShape, spread_choice, unlikeness
from sogjax.engine.example_frames import most_helpful, unsuitable


def shape(frame, part, **values):
    """A frame in which the body fills one of eight parts of the cube."""
    voxels = np.zeros((8, SHAPE_VOXELS**3 // 8), bool)
    voxels[part] = True
    given = {"num_bodies": 1, "whole": 1.0, "agreement": 0.8, "clear": 0.4, "height": 1.6, "known": 1.0}
    return SeenShape(frame=frame, voxels=voxels.reshape(3 * (SHAPE_VOXELS,)), **(given | values))


def test_frames_are_chosen_for_worth_and_for_shapes_not_seen_before():
    same = [shape(k, 0) for k in range(4)]
    other, poor = shape(7, 1), shape(8, 2, agreement=0.1)
    chosen = spread_choice([*same, poor, other], 3)
    assert {found.frame for found in chosen} == {0, 7, 8}
    assert [found.frame for found in chosen] == sorted(found.frame for found in chosen)
    assert unlikeness(same[0], same[1]) == 0.0
    assert unlikeness(same[0], other) == 1.0


@pytest.mark.parametrize(
    ("values", "words"),
    [({"num_bodies": 2}, "more than one person"), ({"known": 0.3}, "same place"), ({"agreement": 0.2}, "nobody")],
)
def test_clips_that_show_no_one_person_apart_are_refused(values, words):
    shapes = [shape(k, k % 8) for k in range(9)]
    assert unsuitable(shapes) is None
    problem = unsuitable([replace(one, **values) for one in shapes])
    assert problem is not None
    assert words in problem


def test_what_would_help_most():
    assert "empty scene" in most_helpful([shape(0, 0, known=0.7)], 12)
    assert "cameras" in most_helpful([shape(0, 0)], 3)
    assert "T-pose" in most_helpful([shape(0, 0)], 12)


def test_colours_decide_where_the_fit_does_not():
    """Blue in front and red behind; in the second moment the wrong way fits a little better."""
    front, back = (
        np.array([[color, other]], float) for color, other in [((0, 0, 1), (1, 0, 0)), ((1, 0, 0), (0, 0, 1))]
    )
    ways = consistent_ways([(1.0, 0.9), (0.99, 1.0), (1.0, 0.9)], [(front, back), (front, back), (front, back)])
    assert ways == (0, 0, 0)
    assert consistent_ways([(1.0, 0.9), (0.99, 1.0)], [(front, front), (front, front)]) == (0, 1)
    assert disagreement([front, front]) == 0.0
    unseen = np.full_like(front, np.nan)
    assert disagreement([front, unseen]) == 0.0
