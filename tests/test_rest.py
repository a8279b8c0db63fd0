"""Joints of small range stay near rest where pictures tell nothing of them."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import BACKGROUND, cells_of, draw, in_colors, make_tracker, moved, standing
from rig_cases import ring_rig
from sog_cases import random_views

from sogjax.actor.colors import colored
from sogjax.energy.posed import Frame, History, Posed
from sogjax.energy.priors import LEAST_PART, REST_SPREAD, RestPenalty, pose_spread
from sogjax.energy.term import Term
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.tracking.culling import Capacities
from sogjax.tracking.tracker import Tracker

STEP = eqx.filter_jit(Tracker.step)
HEAD_BENT = {"neck_bend": 0.6, "head_bend": 0.5}


@pytest.fixture(scope="module")
def human():
    return in_colors(shipped("human"))


@pytest.fixture(scope="module")
def frame(human):
    return Frame(random_views(ring_rig(2).cameras, human, 0, count=4), History.unknown(human.poses["rest"]))


@eqx.filter_jit
def penalty(body, spread, pose, frame):
    return RestPenalty(1.0, spread).value(Posed.from_pose(body, pose), frame)


def value(body, pose, frame):
    return float(penalty(body, pose_spread(body), jnp.asarray(pose), frame))


def test_it_counts_joints_by_their_range_and_no_place_of_the_root(human, frame):
    rest = standing(human, 1.0, (2.0, -3.0))
    assert value(human, rest, frame) == 0.0
    names, skeleton = list(human.skeleton.dof_names), human.skeleton
    found = {}
    for name in ("left_clavicle_raise", "left_knee"):
        k = names.index(name)
        spread = REST_SPREAD * float(skeleton.dof_upper[k] - skeleton.dof_lower[k]) ** 2
        found[name] = value(human, moved(human, rest, {name: 0.2}), frame)
        np.testing.assert_allclose(found[name], (0.2 / spread) ** 2, rtol=1e-5)
    assert found["left_clavicle_raise"] > 20.0 * found["left_knee"]


def test_a_turn_that_pictures_hardly_tell_is_expected_nearer_to_rest(human):
    spread, names = np.asarray(pose_spread(human)), list(human.skeleton.dof_names)
    ranges = np.asarray(human.skeleton.dof_upper - human.skeleton.dof_lower)
    told = {name: spread[k] / (REST_SPREAD * ranges[k] ** 2) for k, name in enumerate(names) if np.isfinite(ranges[k])}
    assert told["left_elbow"] == pytest.approx(1.0)
    assert told["neck_twist"] == pytest.approx(LEAST_PART, rel=0.05)
    assert told["left_forearm_roll"] == pytest.approx(LEAST_PART)
    assert LEAST_PART < told["head_bend"] < told["neck_bend"] < 1.0
    assert np.isinf(spread[names.index("root_yaw")])


def test_a_joint_held_in_one_place_by_its_limits_has_a_finite_penalty(human, frame):
    k = list(human.skeleton.dof_names).index("head_bend")
    held = eqx.tree_at(lambda b: b.skeleton.dof_lower, human, human.skeleton.dof_lower.at[k].set(0.1))
    held = eqx.tree_at(lambda b: b.skeleton.dof_upper, held, held.skeleton.dof_upper.at[k].set(0.1))
    assert (np.asarray(pose_spread(held)) > 0.0).all()
    assert np.isfinite(value(held, moved(held, standing(held, 1.0), {"head_bend": 0.1}), frame))


def test_its_model_is_that_of_its_value(human, frame):
    term = RestPenalty(0.3, pose_spread(human))
    pose = jnp.asarray(moved(human, standing(human, 1.0), HEAD_BENT))
    models = [
        jax.jit(lambda p, k=kind: k.quadratic(term, Posed.from_pose(human, p), frame)) for kind in (RestPenalty, Term)
    ]
    model, by_autodiff = (found(pose) for found in models)
    np.testing.assert_allclose(model.value, by_autodiff.value, rtol=1e-6)
    gradient = jax.jit(jax.grad(lambda p: term.part(Posed.from_pose(human, p), frame)))(pose)
    np.testing.assert_allclose(model.gradient, gradient, rtol=1e-5, atol=1e-6)
    curvature = -jax.jit(jax.hessian(lambda p: term.part(Posed.from_pose(human, p), frame)))(pose)
    np.testing.assert_allclose(model.curvature, curvature, rtol=1e-5, atol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(("weight", "bent"), [(0.0, True), (5e-5, False)])
def test_a_head_that_looks_as_the_background_comes_to_rest(human, weight, bent):
    rig, rest = ring_rig(3, (160, 120)), standing(human, 1.0)
    head = np.array([any(part in name for part in ("jaw", "face", "skull", "neck")) for name in human.blobs.names])
    hidden = np.where(head[:, None], np.array(BACKGROUND[::-1]) / 255.0, np.asarray(human.blob_colors))
    cells = jnp.asarray(cells_of(rig, draw(colored(human, hidden), rest, rig), 6))
    tracker = make_tracker(human, rig, solver=GaussNewton())
    tracker = eqx.tree_at(lambda t: t.terms, tracker, (*tracker.terms, RestPenalty(weight, pose_spread(human))))
    state, room = tracker.start(moved(human, rest, HEAD_BENT)), Capacities(512, 512, 4096)
    for _ in range(5):
        state, found = STEP(tracker, state, cells, room)
    angles = dict(zip(human.skeleton.dof_names, np.asarray(found.pose), strict=True))
    assert (abs(angles["head_bend"]) > 0.3) == bent
