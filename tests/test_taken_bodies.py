"""Cameras whose learnt background took the body."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import BACKGROUND, cells_of, draw, in_colors, standing
from rig_cases import ring_rig
from test_limb_doubt import DEPTH, judging

from sogjax.run.taken_bodies import _seen, that_see_no_foreground
from sogjax.scene.background import BackgroundCells
from sogjax.scene.foreground import BackgroundModel
from sogjax.tracking.frame import FrameInput, on_device

TOOK, HIDDEN = 1, 3
NAMES = ("a", "b", "c", "d", "e")


@pytest.fixture(scope="module")
def seen():
    """What is seen where one camera's background shows the body, and before another one stands a board."""
    body, rig = in_colors(shipped("dog")), ring_rig(5, (160, 120), distance=1.6)
    pose = standing(body, 1.1)
    shown = cells_of(rig, draw(body, pose, rig), DEPTH)
    empty = np.full(shown.shape, BACKGROUND, np.uint8)
    empty[TOOK] = shown[TOOK]
    empty[HIDDEN] = shown[HIDDEN] = (250, 10, 250)
    cells = BackgroundCells(empty, np.full(shown.shape[:3], 0.02, np.float32), np.ones(shown.shape[:3], bool))
    tracker = judging(body, rig, True)
    reader = replace(tracker.reader, background=BackgroundModel.from_background(cells))
    tracker = replace(tracker, reader=reader)
    return [np.asarray(part) for part in _seen(tracker, on_device(FrameInput(shown)), jnp.asarray(pose))]


@pytest.mark.slow
def test_a_camera_that_took_the_body_is_told_from_one_before_which_something_stands(seen):
    overlap, colors = seen
    others = [k for k in range(5) if k not in (TOOK, HIDDEN)]
    assert overlap[0, [TOOK, HIDDEN]].max() < 0.1
    assert overlap[0, others].min() > 0.6
    assert colors[TOOK] > 0.8 * colors[others].min()
    assert colors[HIDDEN] < 0.2
    assert that_see_no_foreground(NAMES, overlap, colors[None]) == [NAMES[TOOK]]


def test_a_camera_that_tells_nothing_in_some_frames_counts_by_the_others(seen):
    overlap, colors = (np.repeat(part.reshape(1, -1), 3, axis=0) for part in seen)
    overlap[1, TOOK] = np.nan
    assert that_see_no_foreground(NAMES, overlap, colors) == [NAMES[TOOK]]
    overlap[:, TOOK] = np.nan
    assert that_see_no_foreground(NAMES, overlap, colors) == []


def test_where_all_cameras_show_little_none_is_blamed(seen):
    overlap, colors = seen
    assert that_see_no_foreground(NAMES, 0.3 * overlap, colors[None]) == []
