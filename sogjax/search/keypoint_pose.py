"""Poses and sizes of a body from triangulated keypoints, some of which may be far off or missing."""

from dataclasses import dataclass, replace
from itertools import combinations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.io.keypoints.scheme import KeypointScheme
from sogjax.model.body import Body
from sogjax.model.program import compiled
from sogjax.model.shape import ShapeModel
from sogjax.search.described_pose import MIN_LANDMARKS, NUM_HEADINGS, dof_spread
from sogjax.search.placed_body import headings, landmarks_of, placed, root_position, turned
from sogjax.search.point_fit import Points, fitted_to_points
from sogjax.solve.gauss_newton import GaussNewton, LeastSquares
from sogjax.solve.solution import Scales

NOISE = 0.03
"""Metres: what a triangulated keypoint is expected to be off, beside what its scheme allows."""
WIDE = 8.0
"""Times the noise from which on a point counts little, while headings are told apart."""
FAR = 3.0
"""Times the noise from which on a point counts little in the last fits."""
LEFT_OUT = 0.25
"""Metres from which on a point is left out of the last fit."""
ON = 0.1
"""Metres within which a fitted landmark is on its keypoint."""
LEAST_LENGTH = 0.12
"""Metres: shorter bones tell nothing of sizes."""
RIGID = 2e-3
"""Metres by which the distance of two points of one bone varies with the pose, in rounding."""


@dataclass(frozen=True)
class KeypointPose:
    """A pose that was fitted to points."""

    pose: Float[np.ndarray, "dof"]
    on: float
    """Share of the known points that the body's landmarks are on."""
    distance: float
    """Mean distance of these, metres; NaN where there are none."""
    num_points: int
    """How many points were known."""


def pose_of_keypoints(
    body: Body, up: str, scheme: KeypointScheme, points: Float[np.ndarray, "keypoint 3"]
) -> KeypointPose | None:
    """The pose whose landmarks lie on most of the points (world, metres; NaN where unknown).

    `body` stands upright in the recording's world (vertical `up`) already. None with fewer than four known points.
    """
    indices = scheme.on(body.landmarks.names)
    known = np.isfinite(points).all(-1) & (indices >= 0)
    if known.sum() < MIN_LANDMARKS:
        return None
    dtype = body.landmarks.offsets.dtype
    noise = np.hypot(NOISE, np.array(scheme.within))
    places = np.where(known[:, None], points, 0.0)
    all_known = Points(
        jnp.asarray(np.maximum(indices, 0)), *(jnp.asarray(part, dtype) for part in (places, noise, known))
    )

    def fitted(starts, far, kept):
        points = replace(all_known, known=jnp.asarray(kept, dtype))
        return fitted_to_points(body, starts, points, jnp.asarray(far, dtype), dof_spread(body))

    poses, costs = fitted(_starts(body, up, np.median(points[known], axis=0)), WIDE, known)
    # From now on the angles stay near what was found, not near the rest pose's.
    pose, _ = fitted(poses[np.argmin(costs)][None], FAR, known)
    near = known & (_distances(body, pose[0], all_known) < LEFT_OUT)
    pose, _ = fitted(pose, FAR, near)
    off = _distances(body, pose[0], all_known)[known]
    on = off < ON
    distance = float(off[on].mean()) if on.any() else float("nan")
    return KeypointPose(np.asarray(pose[0]), float(on.mean()), distance, int(known.sum()))


def bone_pairs(body: Body, indices: Int[np.ndarray, "keypoint"]) -> list[tuple[int, int, float]]:
    """Pairs of keypoints whose landmarks keep their distance in every pose, and that distance in metres."""
    lower, upper = (np.asarray(limit, float) for limit in (body.skeleton.dof_lower, body.skeleton.dof_upper))
    bounds = np.where(np.isfinite(lower), lower, -1.0), np.where(np.isfinite(upper), upper, 1.0)
    drawn = np.random.default_rng(0).uniform(*bounds, (8, len(lower)))
    poses = jnp.asarray(drawn, body.landmarks.offsets.dtype)
    points = landmarks_of(body, poses)
    found = []
    used = [k for k in range(len(indices)) if indices[k] >= 0]
    for a, b in combinations(used, 2):
        lengths = np.linalg.norm(points[:, indices[a]] - points[:, indices[b]], axis=-1)
        if np.ptp(lengths) < RIGID and lengths.mean() > LEAST_LENGTH:
            found.append((a, b, float(lengths.mean())))
    return found


def measured_lengths(
    body: Body, scheme: KeypointScheme, points: Float[np.ndarray, "frame keypoint 3"]
) -> list[tuple[tuple[int, int, float], float]]:
    """The bones that are seen in any frame: keypoints and length in the body, and the median length seen, metres."""
    found = []
    for pair in bone_pairs(body, scheme.on(body.landmarks.names)):
        lengths = np.linalg.norm(points[:, pair[0]] - points[:, pair[1]], axis=-1)
        if np.isfinite(lengths).any():
            found.append((pair, float(np.nanmedian(lengths))))
    return found


def _starts(body: Body, up: str, centre: Float[np.ndarray, "3"]) -> Float[Array, "start dof"]:
    """The rest pose about a point, in all directions."""
    rest = body.poses["rest"]
    middle = np.median(landmarks_of(body, rest[None])[0], axis=0)
    start = placed(body, rest, root_position(body, rest) + centre - middle)
    return jnp.stack([turned(body, start, float(heading), up) for heading in headings(NUM_HEADINGS)])


def _distances(body: Body, pose: Float[Array, "dof"], points: Points) -> Float[np.ndarray, "keypoint"]:
    found = landmarks_of(body, pose[None])[0]
    return np.linalg.norm(found[np.asarray(points.landmarks)] - np.asarray(points.places, float), axis=-1)


LENGTH_NOISE = 0.04
"""Expected deviation of a measured length, as a share of it: detectors' joints are not quite the body's."""
EPSILON, DAMPING, LARGEST_STEP = 1e-4, 1e-7, 0.5
"""Of the fit, in logarithms of scale factors: lengths are products of factors, so the first step nearly solves it."""


def shape_of_keypoints(
    model: ShapeModel, scheme: KeypointScheme, points: Float[np.ndarray, "frame keypoint 3"]
) -> Float[np.ndarray, "shape"] | None:
    """Shape parameters whose bones are as long as those of a person's keypoints (metres; NaN where unknown).

    What no bone tells follows the whole body's size. None where no bone is seen.
    """
    measured = measured_lengths(model.body, scheme, points)
    if not measured:
        return None
    on = scheme.on(model.body.landmarks.names)
    pairs = jnp.asarray(np.array([[on[a], on[b]] for (a, b, _), _ in measured]))
    lengths = jnp.asarray(np.array([length for _, length in measured]), model.spread.dtype)
    return np.asarray(_fitted(_BoneLengths(model, pairs, lengths)))


class _BoneLengths(LeastSquares):
    """How far the bones of a body are from measured lengths, and the shape from what is expected."""

    model: ShapeModel
    pairs: Int[Array, "bone 2"]
    """The landmarks at the ends of each bone."""
    lengths: Float[Array, "bone"]

    def residuals(self, params: Float[Array, "shape"]) -> Float[Array, "residual"]:
        """Logarithms of lengths, and shape parameters, in units of their expected deviations."""
        points = self.model.shaped(params).posed_landmarks(self.model.body.poses["rest"])
        own = jnp.linalg.norm(points[self.pairs[:, 0]] - points[self.pairs[:, 1]], axis=-1)
        return jnp.concatenate([jnp.log(own / self.lengths) / LENGTH_NOISE, params / self.model.spread])


@compiled
def _fitted(fit: _BoneLengths) -> Float[Array, "shape"]:
    start = jnp.zeros_like(fit.model.spread)
    solver = GaussNewton(epsilon=EPSILON, first_damping=DAMPING, smallest_damping=DAMPING, common_damping=0.0)
    steps = jnp.asarray([LARGEST_STEP], start.dtype)
    return solver.maximize(fit, start, Scales(jnp.zeros(start.shape, jnp.int32), steps, steps)).params
