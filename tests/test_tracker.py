"""Tracking drawn scenes whose motion is known."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import posed, shipped
from drawn_scene import cells_of, draw, in_colors, landmark_error, make_tracker, moved, standing
from jaxtyping import Array
from rig_cases import ring_rig

from sogjax.energy.frame_energy import standard_terms
from sogjax.model.body import concatenate, dof_slices
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.solution import Solution
from sogjax.tracking import frame_by_frame
from sogjax.tracking.culling import CAPACITIES, Capacities
from sogjax.tracking.frame import TrackState
from sogjax.tracking.frame_by_frame import compile_step, track
from sogjax.tracking.tracker import Tracker

DEPTH, FINE_DEPTH = 6, 7
"""Cells of 4 and 2 pixels: an arm at 3 m is 5 pixels wide."""
HUMAN_STEP = {
    "root_x": 0.02, "root_yaw": 0.03, "left_shoulder_raise": 0.06, "right_shoulder_swing": 0.06, "left_elbow": 0.05,
    "left_hip_bend": 0.05, "right_knee": 0.05,
}  # fmt: skip
DOG_STEP = {
    "root_x": 0.01, "root_yaw": 0.03, "spine_side": 0.02, "neck_bend": 0.03, "left_front_swing": 0.05,
    "right_hip_bend": 0.05, "tail_side": 0.05,
}  # fmt: skip


def motion(body, start, step, frames):
    """Poses that move by the same step from frame to frame."""
    return [moved(body, start, {name: k * value for name, value in step.items()}) for k in range(frames)]


def filmed(body, rig, poses, depth=DEPTH):
    return [cells_of(rig, draw(body, pose, rig), depth) for pose in poses]


@pytest.fixture(scope="module")
def dog():
    """A dog that walks a little before five cameras: tracker, true poses and frames."""
    body = in_colors(shipped("dog"))
    rig = ring_rig(5, (160, 120), distance=1.6)
    poses = motion(body, standing(body, 1.1), DOG_STEP, 6)
    return make_tracker(body, rig, DEPTH), poses, filmed(body, rig, poses)


def test_the_motion_of_a_dog_is_found(dog):
    tracker, poses, frames = dog
    results = list(track(tracker, jnp.asarray(poses[0]), frames))
    assert [r.index for r in results] == list(range(6))
    errors = [landmark_error(tracker.body, r.result.pose, pose) for r, pose in zip(results, poses, strict=True)]
    assert max(errors) < 0.02
    assert landmark_error(tracker.body, poses[-1], poses[0]) > 0.04
    assert all(r.result.converged for r in results)
    assert all((r.result.num_near <= r.capacities.near).all() for r in results)


@pytest.mark.slow
@pytest.mark.parametrize("around", ["predicted", "last"])
def test_a_frame_is_tracked_in_two_programs_as_by_one_step(dog, around):
    tracker, poses, frames = dog
    tracker = replace(tracker, reader=replace(tracker.reader, box_around=around))
    before = [jnp.asarray(pose) for pose in poses[:2]]
    state = tracker.with_memory(TrackState.from_pose(before[0]).advanced(before[1]))
    capacities = Capacities(1024, 1024)
    (found,) = track(tracker, state, frames[2:3], capacities)
    after, result = eqx.filter_jit(Tracker.step)(tracker, state, frames[2], capacities)
    for ours, of_step in zip(jax.tree.leaves(found.result.images), jax.tree.leaves(result.images), strict=True):
        np.testing.assert_array_equal(ours, of_step)
    np.testing.assert_allclose(found.result.energy, result.energy, rtol=2e-3)  # a hundred steps on a flat hill
    assert landmark_error(tracker.body, found.result.pose, after.previous) < 0.005
    assert landmark_error(tracker.body, found.result.pose, poses[0]) > 0.01


@pytest.mark.slow
def test_a_step_compiled_beforehand_is_that_of_the_first_frame(walking_dog, monkeypatch):
    tracker, cells, right = walking_dog
    monkeypatch.setattr(frame_by_frame, "MOVED", 1.0)  # the dog at rest is where it is
    traced, views, step_in = [], Tracker.views, Tracker.step_in
    monkeypatch.setattr(Tracker, "views", lambda *given: traced.append("views") or views(*given))
    watched = eqx.filter_jit(lambda *given: traced.append("rest") or step_in(*given))
    monkeypatch.setattr(frame_by_frame, "_step_in", watched)
    jax.clear_caches()
    compile_step(tracker, cells[0], right.poses[0])
    assert traced.count("rest") == 1 < traced.count("views")
    beforehand = len(traced)
    first = next(track(tracker, jnp.asarray(right.poses[0]), cells))
    assert len(traced) == beforehand
    assert first.result.iterations > 0


@pytest.mark.slow
def test_a_step_is_lowered_for_a_gpu_with_the_shapes_that_it_has_here(dog):
    tracker, poses, frames = dog
    capacities = Capacities(1024, 1024, 1024)
    given = (tracker, TrackState.from_pose(jnp.asarray(poses[0])), jnp.asarray(frames[0]))
    arrays, others = eqx.partition(given, eqx.is_array)

    def step(arrays):
        tracker, state, cells = eqx.combine(arrays, others)
        return tracker.step(state, cells, capacities)

    lowered = jax.jit(step).trace(arrays).lower(lowering_platforms=("cuda",))
    state, result = lowered.out_info
    assert state.previous.shape == result.pose.shape == poses[0].shape
    assert result.num_near.shape == (len(frames[0]),)
    assert result.images.means.shape == (len(frames[0]), capacities.near, 2)


@pytest.mark.slow
def test_the_motion_of_a_human_is_found_from_a_rough_start():
    body = in_colors(shipped("human"))
    rig = ring_rig(5, (160, 120), distance=3.0)
    poses = motion(body, moved(body, standing(body, 0.95), {"left_elbow": 0.3}), HUMAN_STEP, 6)
    tracker = make_tracker(body, rig, FINE_DEPTH)
    rough = moved(body, poses[0], {"root_x": 0.03, "root_y": -0.03, "left_elbow": -0.1, "root_yaw": 0.05})
    results = list(track(tracker, jnp.asarray(rough), filmed(body, rig, poses, FINE_DEPTH)))
    errors = [landmark_error(body, r.result.pose, pose) for r, pose in zip(results, poses, strict=True)]
    assert max(errors[1:]) < 0.04
    assert landmark_error(body, poses[-1], poses[0]) > 0.1


def test_the_terms_of_a_result_are_those_of_its_pose(dog):
    """The energy is the sum of its parts, and the acceleration is known from the third frame on."""
    tracker, poses, frames = dog
    _, limits, smooth = tracker.terms
    results = [r.result for r in track(tracker, jnp.asarray(poses[0]), frames[:3])]
    for k, result in enumerate(results):
        terms = result.terms
        parts = (
            terms["similarity"] - limits.weight * terms["limit_penalty"] - smooth.weight * terms["acceleration_penalty"]
        )
        np.testing.assert_allclose(result.energy, parts, rtol=1e-5)
        assert (terms["acceleration_penalty"] > 0.0) == (k == 2)
    bend = 0.5 * (results[2].pose + results[0].pose) - results[1].pose
    np.testing.assert_allclose(results[2].terms["acceleration_penalty"], np.sum(bend**2), rtol=1e-3)


@pytest.mark.slow
def test_one_compilation_serves_a_recording_and_every_swept_number(dog):
    """Counted with a solver that stays where it is, which compiles quickly."""
    traces = []

    class Staying(eqx.Module):
        number: Array
        max_iterations: int = 0

        def maximize(self, objective, start, scales):
            traces.append(1)
            value = objective(start) + 0.0 * self.number + 0.0 * jnp.sum(scales.step_bounds)
            none = jnp.asarray(0)
            return Solution(start, value, none, none, jnp.asarray(True))

    tracker, poses, frames = dog
    tracker = eqx.tree_at(lambda t: t.solver, tracker, Staying(jnp.asarray(1.0)))
    start = jnp.asarray(poses[0])
    list(track(tracker, start, frames[:4]))
    assert len(traces) == 1
    changes = {
        lambda t: t.terms: standard_terms(limit_weight=0.3, acceleration_weight=0.02, exponent=0.6),
        lambda t: t.extrapolation: jnp.asarray(0.9),
        lambda t: t.reader.color_radius: jnp.asarray(0.29),
        lambda t: t.reader.color_tolerance: jnp.asarray(0.16),
        lambda t: t.reader.box_enlargement: jnp.asarray(0.16),
        lambda t: t.solver.number: jnp.asarray(2.0),
        lambda t: t.scales.first_steps: tracker.scales.first_steps * 2.0,
    }
    for place, value in changes.items():
        list(track(eqx.tree_at(place, tracker, value), start, frames[:2]))
    assert len(traces) == 1


@pytest.mark.slow
def test_a_frame_that_needs_more_room_is_done_again(dog, monkeypatch):
    """With the same result as with enough room from the start."""
    tracker, poses, frames = dog
    start = jnp.asarray(poses[0])
    roomy = list(track(tracker, start, frames[:2]))
    enough = roomy[0].capacities
    matching = int(max(r.result.num_matching.max() for r in roomy))
    assert matching > 8
    monkeypatch.setattr(frame_by_frame, "first_capacities", lambda *_: Capacities(enough.near, 8))
    grown = list(track(tracker, start, frames[:2]))
    for a, b in zip(grown, roomy, strict=True):
        assert a.capacities.hold(int(a.result.num_near.max()), int(a.result.num_matching.max()))
        assert a.result.num_matching.tolist() == b.result.num_matching.tolist()
        np.testing.assert_allclose(a.result.pose, b.result.pose, atol=2e-3)
        np.testing.assert_allclose(a.result.terms["similarity"], b.result.terms["similarity"], rtol=1e-3)


@pytest.mark.slow
def test_near_pairs_are_tracked_by_gauss_newton_and_too_little_room_is_noticed(dog, monkeypatch):
    """The motion is found as with all pairs, also where the lists begin with too little room."""
    tracker, poses, frames = dog
    tracker = replace(tracker, pairs="sparse", solver=GaussNewton())
    start = jnp.asarray(poses[0])
    room = frame_by_frame.first_capacities
    too_small = lambda *arguments: replace(room(*arguments), blocks=4)
    monkeypatch.setattr(frame_by_frame, "first_capacities", too_small)
    results = list(track(tracker, start, frames))
    errors = [landmark_error(tracker.body, r.result.pose, pose) for r, pose in zip(results, poses, strict=True)]
    assert max(errors) < 0.02
    assert all(4 < int(r.result.num_blocks) <= r.capacities.blocks for r in results)
    assert all(r.result.converged for r in results)


def test_the_next_pose_is_extrapolated(dog):
    """alpha times the last motion is added; the first frames have none."""
    tracker, poses, _ = dog
    state = TrackState.from_pose(jnp.asarray(poses[0]))
    np.testing.assert_array_equal(tracker.predicted(state), poses[0])
    state = state.advanced(jnp.asarray(poses[1]))
    assert state.num_known == 1
    np.testing.assert_array_equal(tracker.predicted(state), poses[1])
    state = state.advanced(jnp.asarray(poses[2]))
    assert state.num_known == 2
    np.testing.assert_allclose(tracker.predicted(state), poses[2] + 0.5 * (poses[2] - poses[1]), atol=1e-6)
    assert state.advanced(jnp.asarray(poses[3])).num_known == 2


def test_the_boxes_hold_the_body_in_the_last_and_the_predicted_pose(dog):
    tracker, poses, _ = dog
    state = TrackState.from_pose(jnp.asarray(poses[0])).advanced(jnp.asarray(poses[0])).advanced(jnp.asarray(poses[3]))
    boxes = np.asarray(eqx.filter_jit(tracker.boxes)(state))
    for pose in (state.previous, tracker.predicted(state)):
        points = np.asarray(posed(tracker.body, pose)[0].means, float)
        for k in range(5):
            world, matrix = (np.asarray(m[k]) for m in (tracker.cameras.camera_from_world, tracker.cameras.intrinsics))
            in_camera = points @ world[:3, :3].T + world[:3, 3]
            pixels = (in_camera / in_camera[:, 2:]) @ matrix[:2].T
            assert (pixels > boxes[k, 0, 0]).all()
            assert (pixels < boxes[k, 0, 1]).all()


@pytest.mark.slow
def test_two_actors_are_tracked_as_one_body():
    """Two dogs side by side, moving in opposite directions."""
    bodies = [in_colors(shipped("dog"), hues) for hues in ((0.0, 60.0), (80.0, 170.0))]
    bodies = [replace(body, name=name) for body, name in zip(bodies, ("a", "b"), strict=True)]
    both = concatenate(bodies)
    rig = ring_rig(5, (160, 120), distance=2.0)
    left, right = standing(bodies[0], 1.1, (0.0, 0.25)), standing(bodies[1], 1.1, (0.0, -0.25))
    ways = [motion(bodies[0], left, {"root_x": 0.02}, 4), motion(bodies[1], right, {"root_x": -0.02}, 4)]
    poses = [np.concatenate(pair) for pair in zip(*ways, strict=True)]
    tracker = make_tracker(both, rig, FINE_DEPTH)
    results = list(track(tracker, jnp.asarray(poses[0]), filmed(both, rig, poses, FINE_DEPTH)))
    for body, part, way in zip(bodies, dof_slices(bodies), ways, strict=True):
        errors = [landmark_error(body, r.result.pose[part], pose) for r, pose in zip(results, way, strict=True)]
        assert max(errors) < 0.03


@pytest.mark.slow
def test_a_tree_with_more_nodes_than_the_largest_capacity_is_tracked():
    # Few of its nodes are leaves near the body: only those need room.
    body = in_colors(shipped("dog"))
    rig = ring_rig(2, (256, 256), distance=1.6)
    tracker = make_tracker(body, rig, 8)
    assert tracker.reader.candidates.sigmas.shape[-1] > CAPACITIES[-1]
    pose = standing(body, 0.4)
    (result,) = track(tracker, jnp.asarray(pose), filmed(body, rig, [pose], 8))
    assert 0 < int(result.result.num_near.max()) <= result.capacities.near < CAPACITIES[-1]
