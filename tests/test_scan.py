"""A clip in one call against the tracker that goes frame by frame."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import cells_of, draw, in_colors, make_tracker, moved, standing
from rig_cases import ring_rig

from sogjax.solve import ConditionedAscent, GaussNewton
from sogjax.tracking import scan as scan_module
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.scan import track_clip

DEPTH = 6
STEP = {"root_x": 0.01, "root_yaw": 0.03, "left_front_swing": 0.05, "tail_side": 0.05}
ROUNDING = 5e-5
"""Radians and metres: what float32 does to a pose when the order of sums changes."""


@pytest.fixture(scope="module")
def dog():
    """A dog that walks before four cameras: tracker, start, cells of five frames."""
    body = in_colors(shipped("dog"))
    rig = ring_rig(4, (160, 120), distance=1.6)
    poses = [moved(body, standing(body, 1.1), {name: k * value for name, value in STEP.items()}) for k in range(5)]
    tracker = eqx.tree_at(lambda t: t.solver, make_tracker(body, rig, DEPTH), ConditionedAscent(max_iterations=25))
    return tracker, jnp.asarray(poses[0]), np.stack([cells_of(rig, draw(body, pose, rig), DEPTH) for pose in poses])


def needed(clip):
    """The room that a clip needed."""
    return [int(np.max(count)) for count in (clip.num_near, clip.num_matching, clip.num_blocks)]


def sparse(tracker):
    return eqx.tree_at(lambda t: t.solver, replace(tracker, pairs="sparse"), GaussNewton(max_iterations=6))


def frame_by_frame(tracker, start, cells):
    return [frame.result for frame in track(tracker, start, cells)]


@pytest.mark.slow
@pytest.mark.parametrize("kind", [lambda t: t, sparse], ids=["dense", "sparse"])
def test_a_scanned_clip_is_the_clip_frame_by_frame(dog, kind):
    tracker, start, cells = dog
    tracker = kind(tracker)
    results = frame_by_frame(tracker, start, cells)
    clip, capacities = track_clip(tracker, start, cells)
    for k, result in enumerate(results):
        np.testing.assert_allclose(clip.pose[k], result.pose, atol=ROUNDING)
        np.testing.assert_allclose(clip.energy[k], result.energy, rtol=1e-4)
        np.testing.assert_allclose(clip.terms["similarity"][k], result.terms["similarity"], rtol=1e-4)
        assert clip.iterations[k] == result.iterations
        assert clip.converged[k] == result.converged
        np.testing.assert_array_equal(clip.num_near[k], result.num_near)
        np.testing.assert_array_equal(clip.num_matching[k], result.num_matching)
        assert clip.num_blocks[k] == result.num_blocks
    assert capacities.hold(*needed(clip))


@pytest.mark.parametrize("kind", [lambda t: t, sparse], ids=["dense", "sparse"])
@pytest.mark.slow
def test_a_clip_that_needs_more_room_is_tracked_again(dog, kind, monkeypatch):
    tracker, start, cells = dog
    tracker = kind(tracker)
    enough, _ = track_clip(tracker, start, cells)
    tight = Capacities(32, 32, 8)
    monkeypatch.setattr(scan_module, "first_capacities", lambda *_: tight)
    clip, capacities = track_clip(tracker, start, cells)
    assert not tight.hold(*needed(clip))
    assert capacities.hold(*needed(clip))
    np.testing.assert_allclose(clip.pose, enough.pose, atol=ROUNDING)
