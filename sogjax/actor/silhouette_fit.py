"""An actor from example poses (Section 5.2): all poses and one set of shape parameters, climbed together.

First Eq. 9 on the binary colours of the silhouettes, which forgives a start that is far off; then, by Gauss-Newton
steps, the edges of the silhouettes themselves, in cells of equal size around the subject: they say exactly where limbs
end.
"""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.actor.coverage import Silhouettes, mismatch, mismatch_equations
from sogjax.actor.silhouettes import PosedPictures
from sogjax.energy.frame_energy import still_energy
from sogjax.energy.priors import limit_penalty, pose_spread
from sogjax.energy.term import Terms
from sogjax.energy.views import Views
from sogjax.model.camera import Camera, undistort, undistorted_sizes
from sogjax.model.compiled import compiled_hastily
from sogjax.model.program import compiled
from sogjax.model.shape import ShapeModel
from sogjax.solve.ascent import ConditionedAscent
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.solution import QuadraticModel, Scales
from sogjax.tracking.solving import pose_scales

MAX_CELLS, COARSE_CELLS = 2048, 512
"""Cells of each camera, at most and at least; a hand is about two wide, or one."""
ALL_CELLS = 8192
"""Cells of all cameras together, within these bounds: the more cameras there are, the less depends on one of them."""
CELL_STEP = 128
"""Each camera has a multiple of so many, so that a program serves most actors of a rig."""
BORDER = 0.12
"""Border around the subject's box, as a part of its longer side."""


def silhouettes_of(pictures: Sequence[PosedPictures], rig: Camera, most: int | None = None) -> Silhouettes:
    """The masks of all poses, with a leading axis for the poses; each camera's has at most so many cells.

    None: its share of `ALL_CELLS`, among the cameras that have masks.
    """
    if most is None:
        share = ALL_CELLS // max(len(posed.masks) for posed in pictures)
        most = min(max(share // CELL_STEP * CELL_STEP, COARSE_CELLS), MAX_CELLS)
    poses = [_pose_cells(posed, int(rig.image_size.shape[0]), most) for posed in pictures]
    means, sigmas, coverage, mask = (np.stack(part) for part in zip(*poses, strict=True))
    dtype = rig.intrinsics.dtype
    as_dtype = lambda array: jnp.asarray(array, dtype)
    undistorted, sigmas = _undistorted(rig, as_dtype(means), as_dtype(sigmas))
    repeated = lambda leaf: jnp.asarray(np.broadcast_to(np.asarray(leaf), (len(pictures), *leaf.shape)))
    return Silhouettes(jax.tree.map(repeated, rig), undistorted, sigmas, as_dtype(coverage), jnp.asarray(mask))


@compiled_hastily
def _undistorted(
    rig: Camera, means: Float[Array, "pose camera cell 2"], sigmas: Float[Array, "pose camera cell"]
) -> tuple[Float[Array, "pose camera cell 2"], Float[Array, "pose camera cell"]]:
    by_pose = lambda of_camera, *arrays: jax.vmap(lambda *of_pose: jax.vmap(of_camera)(rig, *of_pose))(*arrays)
    return by_pose(undistort, means), by_pose(undistorted_sizes, means, sigmas)


def _pose_cells(pictures: PosedPictures, num_cameras: int, most: int) -> tuple[np.ndarray, ...]:
    means = np.zeros((num_cameras, most, 2))
    sigmas, coverage = np.ones((num_cameras, most)), np.zeros((num_cameras, most))
    mask = np.zeros((num_cameras, most), bool)
    for camera, picture in pictures.masks.items():
        cut = cells_of(picture, pictures.untold.get(camera), most)
        count = len(cut.coverage)
        means[camera, :count], sigmas[camera, :count] = cut.centres, cut.sigma
        coverage[camera, :count], mask[camera, :count] = cut.coverage, cut.told
    return means, sigmas, coverage, mask


class MaskCells(NamedTuple):
    """A mask, cut into cells of equal size."""

    centres: Float[np.ndarray, "cell 2"]
    """Pixels as recorded."""
    sigma: float
    """Half a side, pixels."""
    coverage: Float[np.ndarray, "cell"]
    """What part of each cell the mask covers."""
    told: Bool[np.ndarray, "cell"]
    """Whether the mask says something of most of the cell."""


def cells_of(
    mask: Bool[np.ndarray, "_h _w"], untold: Bool[np.ndarray, "_h _w"] | None = None, most: int = MAX_CELLS
) -> MaskCells:
    """The cells of a mask around its subject, at most so many; it says nothing where it is `untold`."""
    top, bottom, left, right = _box(mask)
    height, width = bottom - top, right - left
    side = max(1.0, np.sqrt(height * width / most))
    columns = max(1, int(width / side))
    rows = max(1, min(int(height / side), most // columns))
    crop = lambda region: region[top:bottom, left:right].astype(np.float32)
    share = lambda region: cv2.resize(crop(region), (columns, rows), interpolation=cv2.INTER_AREA).reshape(-1)
    wide, high = width / columns, height / rows
    x = left + (np.arange(columns) + 0.5) * wide - 0.5
    y = top + (np.arange(rows) + 0.5) * high - 0.5
    centres = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    told = np.ones(len(centres), bool) if untold is None else share(untold) < 0.5
    return MaskCells(centres, float(np.sqrt(wide * high) / 2.0), share(mask).astype(float), told)


def _box(mask: Bool[np.ndarray, "_h _w"]) -> tuple[int, int, int, int]:
    """Top, bottom, left and right of the subject with a border, inside the picture."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    border = int(BORDER * max(rows[-1] - rows[0], columns[-1] - columns[0])) + 1
    inside = lambda low, high, size: (max(int(low) - border, 0), min(int(high) + border + 1, size))
    return (*inside(rows[0], rows[-1], mask.shape[0]), *inside(columns[0], columns[-1], mask.shape[1]))


NOISE = 1e-3
"""Weight of the priors: the mismatch (as a part of the mask's area) that tells as little as half a squared standard
deviation of a prior. It is what blobs, being round, cannot fit, and by far the largest part of the noise."""
MAX_ITERATIONS = 60
EPSILON = 0.02
"""Length of the step of some two hundred parameters (radians, metres, logarithms) below which the fit ends."""
DAMPING = 1e-3
"""Least damping: the problem is well posed by its priors, and flat valleys want long steps."""


class SilhouetteFit(eqx.Module):
    """Minus the mismatch of all example poses, less priors, as a function of the poses and the shape parameters.

    The parameters are the poses one after the other, then the shape.
    """

    model: ShapeModel
    silhouettes: Silhouettes
    """The silhouettes, with a leading axis for the poses."""
    spread: Float[Array, "dof"]
    """How far each degree of freedom is expected from rest."""

    @property
    def num_poses(self) -> int:
        """Number of example poses."""
        return self.silhouettes.mask.shape[0]

    def split(self, params: Float[Array, "param"]) -> tuple[Float[Array, "pose dof"], Float[Array, "shape"]]:
        """Poses and shape parameters."""
        num = self.num_poses * self.model.body.skeleton.num_dofs
        return params[:num].reshape(self.num_poses, -1), params[num:]

    def __call__(self, params: Float[Array, "param"]) -> Float[Array, ""]:
        """Minus the mean mismatch of the poses, less the priors."""
        poses, shape = self.split(params)
        one_pose = lambda pose, silhouettes: mismatch(_blobs(self.model, pose, shape), silhouettes)
        misses = jax.lax.map(lambda item: one_pose(*item), (poses, self.silhouettes))
        penalties = jax.vmap(self._pose_penalty)(poses)
        return -jnp.mean(misses + penalties) - self._shape_penalty(shape)

    def quadratic(self, params: Float[Array, "param"]) -> QuadraticModel:
        """Value, gradient, and a curvature that is positive semi-definite."""
        poses, shape = self.split(params)
        parts = jax.lax.map(lambda item: self._pose_equations(item[0], shape, item[1]), (poses, self.silhouettes))
        gradient, curvature = parts.gradient, parts.curvature
        dofs = poses.shape[1]
        prior_value, prior_slope = jax.value_and_grad(self._shape_penalty)(shape)
        own = jax.scipy.linalg.block_diag(*curvature[:, :dofs, :dofs])
        shared = curvature[:, :dofs, dofs:].reshape(-1, shape.shape[0])
        corner = jnp.mean(curvature[:, dofs:, dofs:], axis=0) + jax.hessian(self._shape_penalty)(shape)
        scale = 1.0 / self.num_poses
        return QuadraticModel(
            -jnp.mean(parts.value) - prior_value,
            -jnp.concatenate(
                [scale * gradient[:, :dofs].reshape(-1), jnp.mean(gradient[:, dofs:], axis=0) + prior_slope]
            ),
            jnp.block([[scale * own, scale * shared], [scale * shared.T, corner]]),
        )

    def _pose_equations(self, pose, shape, silhouettes) -> QuadraticModel:
        """One pose's part of the cost (not the objective), by its degrees of freedom and the shape."""
        dofs = pose.shape[0]
        of_params = lambda params: _blobs(self.model, params[:dofs], params[dofs:])
        params = jnp.concatenate([pose, shape])
        parts = mismatch_equations(of_params(params), jax.jacfwd(of_params)(params), silhouettes)
        value, slope = jax.value_and_grad(self._pose_penalty)(pose)
        return QuadraticModel(
            parts.value + value,
            (2.0 * parts.gradient).at[:dofs].add(slope),
            (2.0 * parts.matrix).at[:dofs, :dofs].add(jax.hessian(self._pose_penalty)(pose)),
        )

    def _pose_penalty(self, pose: Float[Array, "dof"]) -> Float[Array, ""]:
        skeleton = self.model.body.skeleton
        lower, upper = skeleton.joint_limits()
        unusual = jnp.sum(((pose - self.model.body.poses["rest"]) / self.spread) ** 2)
        return limit_penalty(skeleton.joint_params(pose), lower, upper) + NOISE * unusual

    def _shape_penalty(self, shape: Float[Array, "shape"]) -> Float[Array, ""]:
        return NOISE * self.model.penalty(shape)


def fitted(
    fit: SilhouetteFit, start: Float[Array, "param"], pose_scales: Scales, max_iterations: int = MAX_ITERATIONS
) -> tuple[Float[Array, "param"], Float[Array, "param"]]:
    """The best poses and shape near a start, and the standard deviation of every parameter.

    What no picture determines keeps the deviation of its prior.
    """
    num_shape = fit.model.num_shape_params
    scales = scales_with_shape(pose_scales, fit.num_poses, num_shape)
    return _fitted(fit, start, scales, jnp.asarray(max_iterations))


@compiled
def _fitted(
    fit: SilhouetteFit, start: Float[Array, "param"], scales: Scales, max_iterations: Int[Array, ""]
) -> tuple[Float[Array, "param"], Float[Array, "param"]]:
    solver = GaussNewton(
        epsilon=EPSILON, max_iterations=max_iterations, first_damping=0.1, smallest_damping=DAMPING, common_damping=0.0
    )
    end = solver.climbed(fit, start, scales)
    variances = jnp.diag(jnp.linalg.pinv(end.model.curvature, hermitian=True))
    return end.params, jnp.sqrt(2.0 * NOISE * jnp.maximum(variances, 0.0))


def scales_with_shape(pose: Scales, num_poses: int, num_shape_params: int) -> Scales:
    """The pose's scales for every example pose, and one more kind for the shape parameters."""
    kinds, num_kinds = np.asarray(pose.kinds), pose.first_steps.shape[0]
    return Scales(
        kinds=jnp.asarray(np.append(np.tile(kinds, num_poses), np.full(num_shape_params, num_kinds, kinds.dtype))),
        first_steps=jnp.append(pose.first_steps, 0.01),
        largest_steps=jnp.append(pose.largest_steps, 0.05),
    )


def _blobs(model: ShapeModel, pose: Float[Array, "dof"], shape: Float[Array, "shape"]) -> Float[Array, "blob 4"]:
    """Means and sigmas (metres, world)."""
    blobs = model.shaped(shape).posed_blobs(pose)
    return jnp.concatenate([blobs.means, blobs.sigmas[:, None]], axis=1)


SHAPE_WEIGHT = 3e-5
"""Weight of the shape's prior in units of the similarity of Eq. 9."""
CLIMB_ITERATIONS = 150


class Estimate(eqx.Module):
    """The poses of the example pictures, the shape parameters they share, and how certain both are."""

    poses: Float[Array, "pose dof"]
    shape_params: Float[Array, "shape"]
    pose_deviations: Float[Array, "pose dof"]
    """Standard deviations, radians and metres."""
    shape_deviations: Float[Array, "shape"]
    """Standard deviations of the logarithms of scale factors."""


def estimate_shape(
    model: ShapeModel,
    poses: Float[Array, "pose dof"],
    views: Views,
    silhouettes: Silhouettes,
    terms: Terms,
    max_iterations: tuple[int, int] = (CLIMB_ITERATIONS, MAX_ITERATIONS),
    rest_weights: Float[np.ndarray, "dof"] | None = None,
) -> Estimate:
    """The poses and the one shape that fit all masks best, from rough poses.

    `views` and `silhouettes` have a leading axis for the poses; `max_iterations` are those of the climb and of the fit,
    for which being near rest counts so many times as much as usual, by degree of freedom; deviations are as usual.
    """
    scales, num_poses = pose_scales(model.body.skeleton), poses.shape[0]
    start = jnp.concatenate([poses.reshape(-1), jnp.zeros(model.num_shape_params, poses.dtype)])
    with_shape = scales_with_shape(scales, num_poses, model.num_shape_params)
    start = _climb(model, start, num_poses, views, terms, with_shape, jnp.asarray(max_iterations[0]))
    return _edges(model, start, silhouettes, max_iterations[1], rest_weights)


def fit_edges(
    model: ShapeModel, near: Estimate, silhouettes: Silhouettes, max_iterations: int = MAX_ITERATIONS
) -> Estimate:
    """The poses and the one shape near an estimate that fit the edges of all masks best."""
    return _edges(model, jnp.append(near.poses, near.shape_params), silhouettes, max_iterations)


def _edges(
    model: ShapeModel,
    start: Float[Array, "param"],
    silhouettes: Silhouettes,
    max_iterations: int,
    rest_weights: Float[np.ndarray, "dof"] | None = None,
) -> Estimate:
    spread, scales = pose_spread(model.body), pose_scales(model.body.skeleton)
    fit = SilhouetteFit(model, silhouettes, spread)
    if rest_weights is None or np.all(rest_weights == 1.0):
        params, deviations = fitted(fit, start, scales, max_iterations)
    else:
        held = SilhouetteFit(model, silhouettes, spread / np.sqrt(rest_weights))
        params, _ = fitted(held, start, scales, max_iterations)
        _, deviations = fitted(fit, params, scales, 0)
    return Estimate(*fit.split(params), *fit.split(deviations))


def compile_estimate(model: ShapeModel, views: Views, silhouettes: Silhouettes, terms: Terms) -> None:
    """Compile beforehand what `estimate_shape` needs, while other work goes on."""
    num_poses = silhouettes.mask.shape[0]
    estimate_shape(model, jnp.tile(model.body.poses["rest"], (num_poses, 1)), views, silhouettes, terms, (0, 0))


@compiled
def _climb(
    model: ShapeModel,
    start: Float[Array, "param"],
    num_poses: int,
    views: Views,
    terms: Terms,
    scales: Scales,
    max_iterations: Int[Array, ""],
) -> Float[Array, "param"]:
    """The mean of Eq. 9 over the example poses, climbed; the poses one after the other, then the shape."""
    num_pose_params = num_poses * model.body.skeleton.num_dofs

    def objective(params: Float[Array, "param"]) -> Float[Array, ""]:
        shape = params[num_pose_params:]
        poses = params[:num_pose_params].reshape(num_poses, -1)
        scores = jax.vmap(still_energy, in_axes=(None, 0, 0, None))(model.shaped(shape), poses, views, terms)
        return jnp.mean(scores) - SHAPE_WEIGHT * model.penalty(shape)

    return ConditionedAscent(max_iterations=max_iterations).maximize(objective, start, scales).params
