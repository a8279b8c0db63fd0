"""A clip in one call, and many trackers in one call, against the tracker that goes frame by frame."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import cells_of, draw, in_colors, make_tracker, moved, standing
from rig_cases import ring_rig

from sogjax.solve import ConditionedAscent, GaussNewton
from sogjax.track import scan as scan_module
from sogjax.track.culling import Capacities
from sogjax.track.many import Members, member, same_program, track_many
from sogjax.track.scan import replayed, track_clip
from sogjax.track.tracker import track

DEPTH = 6
STEP = {"root_x": 0.01, "root_yaw": 0.03, "left_front_swing": 0.05, "tail_side": 0.05}
ROUNDING = 5e-5
"""Radians and metres: what float32 does to a pose when the order of sums changes."""
UNNOTICED = 2e-3
"""What blobs outside a member's own boxes may do, as much as the solver's epsilon."""


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


def different(tracker):
    """Members that differ in numbers of every kind."""
    change = lambda where, value: eqx.tree_at(where, tracker, jnp.asarray(value))
    return [
        tracker,
        change(lambda t: t.solver.grow, 1.6),
        change(lambda t: t.weights.acceleration_weight, 0.3),
        change(lambda t: t.solver.epsilon, 0.03),
        change(lambda t: t.extrapolation, 0.9),
        change(lambda t: t.reader.color_radius, 0.2),
    ]


@pytest.mark.parametrize(
    "kind", [pytest.param(lambda t: t, marks=pytest.mark.slow, id="dense"), pytest.param(sparse, id="sparse")]
)
def test_a_scanned_clip_is_the_clip_frame_by_frame(dog, kind):
    tracker, start, cells = dog
    tracker = kind(tracker)
    results = frame_by_frame(tracker, start, cells)
    clip, capacities = track_clip(tracker, start, cells)
    for k, result in enumerate(results):
        np.testing.assert_allclose(clip.pose[k], result.pose, atol=ROUNDING)
        np.testing.assert_allclose(clip.terms.energy[k], result.terms.energy, rtol=1e-4)
        np.testing.assert_allclose(clip.terms.similarity[k], result.terms.similarity, rtol=1e-4)
        assert clip.iterations[k] == result.iterations
        assert clip.converged[k] == result.converged
        np.testing.assert_array_equal(clip.num_near[k], result.num_near)
        np.testing.assert_array_equal(clip.num_matching[k], result.num_matching)
        assert clip.num_blocks[k] == result.num_blocks
    assert capacities.hold(*needed(clip))
    for with_images in (True, False):
        again = list(replayed(clip, capacities, 0.1, with_images)(tracker, start, cells))
        assert [frame.index for frame in again] == list(range(len(cells)))
        for frame, result in zip(again, results, strict=True):
            np.testing.assert_allclose(frame.result.pose, result.pose, atol=ROUNDING)
            blobs, expected = frame.result.images, result.images
            assert blobs.mask.sum() == (expected.mask.sum() if with_images else 0)
            sigmas = lambda sog: np.sum(np.asarray(sog.sigmas)[np.asarray(sog.mask)])
            np.testing.assert_allclose(sigmas(blobs), sigmas(expected) * with_images, rtol=1e-5)


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


def alone(trackers, start, cells):
    return np.stack([np.stack([r.pose for r in frame_by_frame(t, start, cells)]) for t in trackers], axis=1)


@pytest.mark.slow
def test_many_trackers_find_what_each_finds_alone(dog):
    tracker, start, cells = dog
    trackers = different(tracker)
    expected = alone(trackers, start, cells)
    assert np.abs(expected[:, 1:] - expected[:, :1]).max(axis=(0, 2)).min() > 10 * ROUNDING  # every number matters
    starts = jnp.stack([start] * len(trackers))
    own, capacities = track_many(trackers, starts, cells, common_boxes=False)
    np.testing.assert_allclose(own.pose, expected, atol=ROUNDING)
    assert capacities.hold(*needed(own))
    clip, _ = track_clip(trackers[2], start, cells)
    np.testing.assert_allclose(member(own, 2).terms.energy, clip.terms.energy, rtol=1e-4)
    np.testing.assert_array_equal(member(own, 2).iterations, clip.iterations)
    common, _ = track_many(trackers, starts, cells)
    np.testing.assert_allclose(common.pose, expected, atol=UNNOTICED)
    assert (np.asarray(common.num_near) >= np.asarray(own.num_near)).all()


@pytest.mark.slow
def test_members_in_step_find_the_same(dog):
    """With Gauss-Newton: the ascent's steps by signs of gradients magnify rounding."""
    tracker, start, cells = dog
    trackers = different(tracker)[:3]
    trackers = [sparse(tracker) for tracker in trackers]
    in_step, _ = track_many(trackers, jnp.stack([start] * 3), cells, "in_step", common_boxes=False)
    np.testing.assert_allclose(in_step.pose, alone(trackers, start, cells), atol=UNNOTICED)


@pytest.mark.slow
def test_many_sparse_gauss_newton_trackers(dog):
    tracker, start, cells = dog
    change = lambda where, value: eqx.tree_at(where, sparse(tracker), jnp.asarray(value))
    trackers = [
        sparse(tracker),
        change(lambda t: t.weights.acceleration_weight, 0.3),
        change(lambda t: t.reader.color_radius, 0.2),
    ]
    starts = jnp.stack([start] * len(trackers)).at[1, 0].add(0.01)
    expected = np.stack(
        [np.stack([r.pose for r in frame_by_frame(t, s, cells)]) for t, s in zip(trackers, starts, strict=True)], axis=1
    )
    many, _ = track_many(trackers, starts, cells, common_boxes=False)
    np.testing.assert_allclose(many.pose, expected, atol=ROUNDING)
    common, _ = track_many(trackers, starts, cells)
    np.testing.assert_allclose(common.pose, expected, atol=UNNOTICED)


def test_members_share_what_is_equal_and_refuse_what_one_program_cannot_serve(dog):
    tracker, _, _ = dog
    members = Members.from_trackers(different(tracker)[:3])
    assert members.swept.weights.acceleration_weight.shape == (3,)
    assert members.swept.body.blob_sigmas is None
    assert members.shared.weights.acceleration_weight is None
    one = members.of(eqx.tree_at(lambda t: t.weights.acceleration_weight, members.swept, jnp.asarray(0.2)))
    assert float(one.weights.acceleration_weight) == pytest.approx(0.2)
    assert not same_program(tracker, replace(tracker, pairs="sparse"))
    with pytest.raises(ValueError, match="more than the values"):
        Members.from_trackers([tracker, sparse(tracker)])
