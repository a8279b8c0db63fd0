"""The parts of an adjustment: the arrow, smoothness, contact, shapes and the choice of frames, against their laws."""

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped

from sogjax.refine.arrow import ArrowSystem
from sogjax.refine.clip_priors import MovingBlobs, contact_model, floor_height, smooth_model, standing, undersides
from sogjax.refine.clip_shape import ClipShape, frames_by_spread

HUMAN = shipped("human")
UP = np.array([0.0, 0.0, 1.0])
EXACT = 1e-9


def random_system(frames, dofs, shared, seed=0):
    """A system and the whole matrix that it stands for."""
    rng = np.random.default_rng(seed)
    own = rng.normal(size=(frames, dofs, dofs))
    own = own @ np.swapaxes(own, 1, 2) + 6.0 * dofs * np.eye(dofs)
    beside, after = rng.normal(size=(frames, dofs, dofs)), rng.normal(size=(frames, dofs))
    beside[-1:], after[-2:] = 0.0, 0.0
    cross, corner = rng.normal(size=(frames, dofs, shared)), 3.0 * frames * dofs * np.eye(shared)
    system = ArrowSystem(own, beside, after, cross, corner, rng.normal(size=(frames, dofs)), rng.normal(size=shared))
    count = frames * dofs
    whole = np.zeros((count + shared, count + shared))
    at = lambda t: slice(t * dofs, (t + 1) * dofs)
    for t in range(frames):
        whole[at(t), at(t)], whole[at(t), count:], whole[count:, at(t)] = own[t], cross[t], cross[t].T
        if t + 1 < frames:
            whole[at(t), at(t + 1)], whole[at(t + 1), at(t)] = beside[t], beside[t].T
        if t + 2 < frames:
            whole[at(t), at(t + 2)] = whole[at(t + 2), at(t)] = np.diag(after[t])
    whole[count:, count:] = corner
    return system, whole


@pytest.mark.parametrize(("frames", "shared"), [(7, 3), (1, 2), (2, 2), (6, 0)])
def test_an_arrow_is_solved_as_the_whole_matrix(frames, shared):
    system, whole = random_system(frames, 4, shared)
    damping, shared_damping = np.full((frames, 4), 0.3), np.full(shared, 0.7)
    right = np.concatenate([system.gradient.reshape(-1), system.shared_gradient])
    expected = np.linalg.solve(whole + np.diag(np.concatenate([damping.reshape(-1), shared_damping])), right)
    poses, rest = system.step(damping, shared_damping)
    np.testing.assert_allclose(np.concatenate([poses.reshape(-1), rest]), expected, atol=EXACT)
    gain = expected @ right - 0.5 * expected @ whole @ expected
    assert system.expected_gain(poses, rest) == pytest.approx(gain, abs=EXACT)


def differences(value, at, step=1e-6):
    """The gradient by central differences."""
    gradient = np.zeros_like(at)
    for index in np.ndindex(at.shape):
        moved = [at.copy(), at.copy()]
        moved[0][index] += step
        moved[1][index] -= step
        gradient[index] = (value(moved[0]) - value(moved[1])) / (2.0 * step)
    return gradient


def test_smoothness_has_the_gradient_of_its_value_and_forgives_what_is_sudden():
    rng = np.random.default_rng(1)
    poses, frames = rng.normal(scale=0.05, size=(7, 3)), np.arange(7)
    value = lambda p: smooth_model(p, frames, 2.0, 0.06, 1).value
    model = smooth_model(poses, frames, 2.0, 0.06, 1)
    np.testing.assert_allclose(model.gradient, differences(value, poses), atol=1e-7)
    jump = np.zeros((7, 1))
    jump[3:] = 1.0
    assert value(10.0 * jump) > 12.0 * value(jump)  # negative; squares would be 100 times as much


@pytest.mark.parametrize("step", [1, 2])
def test_frames_apart_are_not_joined(step):
    poses = np.array([[0.0], [1.0], [0.0], [5.0], [0.0]])
    together = smooth_model(poses, step * np.array([0, 1, 2, 9, 10]), 1.0, 100.0, step)
    assert together.value == pytest.approx(-0.5 * 2.0**2)
    assert np.all(together.gradient[3:] == 0.0)


def linear_blobs(poses, shape, seed=2):
    """Blobs that move in straight lines with poses and shape, and everything that says so."""
    rng = np.random.default_rng(seed)
    by_pose, by_shape = rng.normal(size=(3, 3, poses.shape[1])), rng.normal(size=(3, 3, len(shape)))
    sizes = rng.normal(scale=0.1, size=(3, len(shape)))
    turned = by_shape[None] * (1.0 + 0.1 * np.arange(len(poses)))[:, None, None, None]
    means = np.einsum("bid,td->tbi", by_pose, poses) + np.einsum("tbis,s->tbi", turned, shape)
    repeated = np.broadcast_to(by_pose, (len(poses), *by_pose.shape))
    return MovingBlobs(means, repeated, turned, 0.05 + sizes @ shape, sizes)


def test_contact_has_the_gradient_of_its_value():
    rng = np.random.default_rng(3)
    poses, shape = rng.normal(scale=0.1, size=(5, 2)), rng.normal(scale=0.1, size=2)
    pairs = np.zeros((5, 3), bool)
    pairs[1:3, 0] = pairs[0, 2] = True
    model = lambda p, s: contact_model(linear_blobs(p, s), 0.02, UP, pairs, 4.0)
    found = model(poses, shape)
    np.testing.assert_allclose(found.gradient, differences(lambda p: model(p, shape).value, poses), atol=1e-7)
    np.testing.assert_allclose(found.shared_gradient, differences(lambda s: model(poses, s).value, shape), atol=1e-7)
    step, rest = 1e-4 * rng.normal(size=(5, 2)), 1e-4 * rng.normal(size=2)
    system = ArrowSystem(
        found.own, found.next, np.zeros((5, 2)), found.cross, found.corner, found.gradient, found.shared_gradient
    )
    gain = model(poses + step, shape + rest).value - found.value
    assert system.expected_gain(step, rest) == pytest.approx(gain, rel=1e-6)


def walking_feet(frames=20, fps=30.0):
    """Two feet: one stands, the other swings over the floor; a head high above."""
    time = np.arange(frames) / fps
    means = np.zeros((frames, 3, 3))
    means[:, 0] = (0.0, 0.1, 0.055)
    means[:, 1] = np.stack([2.0 * time, np.full(frames, -0.1), 0.06 + 0.1 * np.sin(9.0 * time) ** 2], axis=1)
    means[:, 2] = (0.3, 0.0, 1.6)
    return means, np.array([0.04, 0.04, 0.08])


@pytest.mark.parametrize("step", [1, 3])
def test_a_foot_that_is_slow_and_low_stands(step):
    means, sigmas = walking_feet()
    heights = undersides(means, sigmas, UP)
    floor = floor_height(heights)
    assert floor == pytest.approx(0.0, abs=0.005)
    pairs = standing(means, heights - floor, step * np.arange(20), 30.0 * step, step)
    assert pairs[:-1, 0].all()
    assert not pairs[-1].any()
    assert not pairs[:, 1:].any()


def test_somebody_in_the_air_has_no_floor():
    means, sigmas = walking_feet()
    means[..., 2] += np.linspace(0.0, 1.0, 20)[:, None]
    floor = floor_height(undersides(means, sigmas, UP))
    assert np.isnan(floor)
    assert not standing(means, undersides(means, sigmas, UP) - floor, np.arange(20), 30.0, 1).any()


@pytest.fixture(scope="module")
def shape():
    return ClipShape.from_body(HUMAN, "z")


def moved_by(shape, name, value):
    params = np.zeros(shape.num_params, np.float32)
    params[shape.names.index(name)] = value
    return shape.shaped(jnp.asarray(params))


def test_no_parameters_leave_the_body_as_it_is(shape):
    same = shape.shaped(jnp.zeros(shape.num_params))
    np.testing.assert_allclose(same.skeleton.offsets, HUMAN.skeleton.offsets, atol=1e-7)
    np.testing.assert_allclose(same.blobs.offsets, HUMAN.blobs.offsets, atol=1e-7)


@pytest.mark.slow
def test_a_joint_that_moves_leaves_the_flesh_and_the_other_joints(shape):
    body, rest = moved_by(shape, "shoulder.y", 0.02), HUMAN.poses["rest"]
    np.testing.assert_allclose(body.posed_blobs(rest).means, HUMAN.posed_blobs(rest).means, atol=1e-6)
    change = np.asarray(body.posed_landmarks(rest) - HUMAN.posed_landmarks(rest))
    expected = np.zeros_like(change)
    names = list(HUMAN.landmarks.names)
    expected[names.index("left_shoulder"), 1] = 0.02
    expected[names.index("right_shoulder"), 1] = -0.02
    np.testing.assert_allclose(change, expected, atol=1e-6)


def test_a_world_with_another_vertical_turns_the_places(shape):
    from sogjax.model.rotation import world_from_upright

    turn = world_from_upright("-y")
    turned = ClipShape.from_body(HUMAN.rotated(jnp.asarray(turn, jnp.float32)), "-y")
    there, here = (moved_by(each, "hip.x", 0.01).skeleton.offsets for each in (turned, shape))
    np.testing.assert_allclose(there, np.asarray(here) @ turn.T, atol=1e-6)


def test_frames_are_chosen_where_poses_differ_and_the_body_was_seen():
    dofs = list(HUMAN.skeleton.dof_names)
    poses = np.zeros((40, len(dofs)))
    poses[10, dofs.index("left_elbow")] = poses[20, dofs.index("right_knee")] = 1.5
    poses[30, dofs.index("left_hip_bend")] = 1.5
    poses[:, dofs.index("root_x")] = np.arange(40.0)  # where the body is says nothing of its shape
    seen = np.full(40, 0.05)
    seen[30] = 0.02
    chosen = frames_by_spread(HUMAN.skeleton, poses, seen, 3)
    assert {10, 20} < set(chosen.tolist())
    assert 30 not in chosen
    assert len(frames_by_spread(HUMAN.skeleton, poses, np.full(40, np.nan), 60)) == 40
