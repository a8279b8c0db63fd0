"""The fit of poses and shape to the edges of silhouettes: its formula, its derivatives, and where it ends."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from rig_cases import ring_rig

from sogjax.actor import silhouette_fit
from sogjax.actor.coverage import Silhouettes, _blobs, _covered, _fills, mismatch
from sogjax.actor.silhouette_fit import (
    COARSE_CELLS,
    MAX_CELLS,
    MAX_ITERATIONS,
    Estimate,
    SilhouetteFit,
    cells_of,
    fitted,
    silhouettes_of,
)
from sogjax.actor.silhouettes import PosedPictures
from sogjax.energy.priors import pose_spread
from sogjax.model.camera import project
from sogjax.model.shape import LENGTH_SPREAD, ShapeModel
from sogjax.tracking.solving import pose_scales

GRADIENT = 2e-3
"""Relative, float32."""


def cells_covered_by(body, pose, rig):
    """Silhouettes that a body throws itself: cells whose sum of Gaussians is over a half are covered."""
    cameras = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), rig.cameras)
    width, height = rig.image_size(rig.names[0])
    x, y = np.meshgrid(np.arange(1.5, width, 4.0), np.arange(1.5, height, 4.0))
    centres = np.stack([x, y], axis=-1).reshape(-1, 2)
    seen = jax.vmap(project, in_axes=(0, None))(cameras, body.posed_blobs(pose))
    offsets = centres[None, None] - np.asarray(seen.means)[:, :, None]
    sums = np.exp(-(offsets**2).sum(-1) / (2.0 * np.asarray(seen.sigmas)[:, :, None] ** 2)).sum(1)
    count = len(rig.names)
    stack = lambda array: jnp.asarray(np.broadcast_to(array, (1, count, *array.shape)), jnp.float32)
    return Silhouettes(
        jax.tree.map(lambda leaf: leaf[None], cameras),
        stack(centres),
        stack(np.full(len(centres), 2.0)),
        jnp.asarray((sums > 0.5)[None], jnp.float32),
        jnp.ones((1, count, len(centres)), bool),
    )


@pytest.fixture(scope="module")
def case():
    """A dog standing before four cameras; the fit starts from the body it really is."""
    dog = shipped("dog")
    names = list(dog.skeleton.dof_names)
    pose = dog.poses["trot_left"].at[names.index("root_z")].set(1.0)
    rig = ring_rig(4, (160, 120), distance=1.5)
    model = ShapeModel.from_body(dog)
    fit = SilhouetteFit(model, cells_covered_by(dog, pose, rig), pose_spread(dog))
    return fit, jnp.concatenate([pose, jnp.zeros(model.num_shape_params)])


def held(near, model, silhouettes, weight):
    """The fit near an estimate, with so much weight of being near rest."""
    start = jnp.append(near.poses, near.shape_params)
    return silhouette_fit._edges(
        model, start, silhouettes, MAX_ITERATIONS, np.full(len(near.poses[0]), weight, np.float32)
    )


def moved(params, fit):
    """Parameters a little way off, the same in every run."""
    rng = np.random.default_rng(5)
    return params + jnp.asarray(0.03 * rng.normal(size=params.shape), params.dtype)


@pytest.mark.slow
@pytest.mark.parametrize("seen", [[True] * 4, [True, False, True, True]], ids=["all cameras", "one without a mask"])
def test_the_quadratic_model_has_the_value_and_the_gradient_of_the_objective(case, seen):
    fit, truth = case
    mask = fit.silhouettes.mask & jnp.asarray(seen)[None, :, None]
    fit = eqx.tree_at(lambda f: f.silhouettes.mask, fit, mask)
    params = moved(truth, fit)
    value, gradient = eqx.filter_jit(jax.value_and_grad(lambda p: fit(p)))(params)
    model = eqx.filter_jit(SilhouetteFit.quadratic)(fit, params)
    np.testing.assert_allclose(model.value, value, rtol=1e-4)
    np.testing.assert_allclose(model.gradient, gradient, atol=GRADIENT * float(jnp.abs(gradient).max()))


@pytest.mark.slow
def test_the_curvature_is_positive_and_predicts_the_objective_where_all_fits(case):
    """With masks that the body throws exactly, the neglected part of the Hessian is small."""
    fit, truth = case
    exact = eqx.tree_at(lambda f: f.silhouettes.coverage, fit, soft_coverage(fit, truth))
    model = eqx.filter_jit(SilhouetteFit.quadratic)(exact, truth)
    assert np.linalg.eigvalsh(np.asarray(model.curvature, float)).min() > -1e-4
    objective = eqx.filter_jit(lambda p: exact(p))
    rng = np.random.default_rng(1)
    for _ in range(3):
        step = jnp.asarray(0.002 * rng.normal(size=truth.shape), truth.dtype)
        rise = float(objective(truth + step) - model.value - model.gradient @ step)
        expected = -0.5 * float(step @ model.curvature @ step)
        assert abs(rise - expected) < 0.25 * abs(expected)


def soft_coverage(fit, params):
    """What the formula itself says that the body covers: found by asking for the mismatch with an empty mask."""
    poses, shape = fit.split(params)
    blobs = fit.model.shaped(shape).posed_blobs(poses[0])
    points = jnp.concatenate([blobs.means, blobs.sigmas[:, None]], axis=1)
    silhouettes = jax.tree.map(lambda leaf: leaf[0], fit.silhouettes)

    def camera(cameras, means, sigmas):
        fills = _fills(project(cameras, _blobs(points)), means, sigmas)
        return jax.vmap(_covered)(jnp.sum(fills, axis=0))

    return eqx.filter_jit(jax.vmap(camera))(silhouettes.cameras, silhouettes.means, silhouettes.sigmas)[None]


@pytest.mark.slow
def test_one_blob_covers_a_half_where_its_gaussian_is_a_half():
    rig = ring_rig(1, (64, 48), distance=2.0)
    cameras = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), rig.cameras)
    blob = jnp.asarray([[0.0, 0.0, 1.0, 0.2]], jnp.float32)
    camera = jax.tree.map(lambda leaf: leaf[0], cameras)
    seen = project(camera, _blobs(blob))
    edge = np.asarray(seen.means)[0] + np.array([float(seen.sigmas[0]) * np.sqrt(2.0 * np.log(2.0)), 0.0])
    at_edge = Silhouettes(
        cameras,
        jnp.asarray(edge, jnp.float32)[None, None],
        jnp.full((1, 1), 1e-2),
        jnp.full((1, 1), 0.5),
        jnp.ones((1, 1), bool),
    )
    assert float(mismatch(blob, at_edge)) < 1e-6


@pytest.mark.slow
def test_a_start_a_little_off_ends_at_the_truth(case):
    fit, truth = case
    names = list(fit.model.body.skeleton.dof_names)
    start = truth.at[names.index("root_x")].add(0.03).at[names.index("root_yaw")].add(np.radians(8.0))
    found, deviations = fitted(fit, start, pose_scales(fit.model.body.skeleton))
    landmarks = lambda params: np.asarray(
        fit.model.shaped(fit.split(params)[1]).posed_landmarks(fit.split(params)[0][0]), float
    )
    assert np.linalg.norm(landmarks(found) - landmarks(truth), axis=1).mean() < 0.02
    shape = np.asarray(deviations)[-fit.model.num_shape_params :]
    assert np.all(shape <= 1.01 * np.asarray(fit.model.spread))
    assert shape[0] < 0.2 * float(fit.model.spread[0])


@pytest.mark.slow
def test_where_masks_say_little_a_body_can_be_held_nearer_to_rest(case):
    fit, truth = case
    side = fit.silhouettes.means[..., 0] < 80.0  # the half of each picture that says nothing
    some = eqx.tree_at(lambda f: f.silhouettes.mask, fit, fit.silhouettes.mask & ~side).silhouettes
    dofs = fit.model.body.skeleton.num_dofs
    near = Estimate(truth[None, :dofs], truth[dofs:], truth[None, :dofs], truth[dofs:])
    rest = fit.model.body.poses["rest"]
    away = lambda weight: jnp.sum(((held(near, fit.model, some, weight).poses[0] - rest) / fit.spread) ** 2)
    assert away(25.0) < 0.7 * away(1.0)


def test_cells_cover_what_the_mask_does():
    mask = np.zeros((300, 200), bool)
    mask[100:220, 60:130] = True
    centres, sigma, covered, told = cells_of(mask)
    assert told.all()
    assert len(covered) <= MAX_CELLS
    np.testing.assert_allclose((2.0 * sigma) ** 2 * covered.sum(), mask.sum(), rtol=0.02)
    inside = covered > 0.99
    assert centres[inside].min(axis=0)[0] >= 59.0
    assert centres[inside].max(axis=0)[1] <= 220.0


@pytest.mark.slow
@pytest.mark.parametrize(("seeing", "cells"), [(2, MAX_CELLS), (4, MAX_CELLS), (12, 640), (16, COARSE_CELLS)])
def test_cells_are_shared_out_among_the_cameras_that_have_masks(seeing, cells):
    rig, mask = ring_rig(16, (200, 300), distance=3.0), np.zeros((300, 200), bool)
    mask[20:280, 30:170] = True
    pictures = PosedPictures("squat", {}, {2 * k % 16 + k // 8: mask for k in range(seeing)})
    silhouettes = silhouettes_of([pictures], jax.tree.map(jnp.asarray, rig.cameras))
    assert silhouettes.mask.shape == (1, 16, cells)
    assert np.asarray(silhouettes.mask[0]).any(axis=1).sum() == seeing


def test_cells_tell_nothing_where_a_mask_does_not():
    mask, untold = np.zeros((2, 300, 200), bool)
    mask[100:160, 60:130] = True
    untold[160:220, 60:130] = True
    cut = cells_of(mask, untold)
    below = (cut.centres[:, 1] > 160) & (cut.centres[:, 0] > 60) & (cut.centres[:, 0] < 130)
    np.testing.assert_array_equal(cut.told, ~below)


def test_left_and_right_are_tied_unless_asked_otherwise():
    human = shipped("human")
    tied, free = ShapeModel.from_body(human), ShapeModel.from_body(human, symmetric=False)
    assert tied.num_shape_params < free.num_shape_params
    shape = jnp.zeros(free.num_shape_params).at[free.names.index("left_upper_arm_length")].set(np.log(1.2))
    length = lambda body, side: float(
        sum(
            np.linalg.norm(np.asarray(body.skeleton.offsets)[body.skeleton.names.index(f"{side}_{joint}")])
            for joint in ("upper_arm_roll", "elbow")
        )
    )
    longer = free.shaped(shape)
    np.testing.assert_allclose(length(longer, "left"), 1.2 * length(human, "left"), rtol=1e-5)
    np.testing.assert_allclose(length(longer, "right"), length(human, "right"), rtol=1e-6)
    assert float(free.spread[free.names.index("left_upper_arm_length")]) == pytest.approx(LENGTH_SPREAD)
