"""The pose of the first frame from a rough description: a named pose and a place, or a handful of landmarks."""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.errors import InputError, counted
from sogjax.io.initial_pose import PoseDescription
from sogjax.model.body import Body
from sogjax.search.placed_body import heading_dof, headings, landmarks_of, placed, root_dofs, root_position, turned
from sogjax.search.point_fit import ANYWHERE, Points, fitted_to_points

LANDMARK_NOISE = 0.03
"""Metres: what a landmark is expected to be off."""
POSE_SPREAD = 0.5
"""Radians: how far joint angles lie from the start pose. Large against what landmarks say of most angles; it decides
where they say next to nothing, as of the twist of a straight arm."""
ROOT_SPREAD = 10.0
"""Radians and metres: nothing is known of place and heading."""
NUM_HEADINGS = 12
MIN_LANDMARKS = 4


def rough_pose(body: Body, description: PoseDescription, up: str) -> Float[Array, "dof"]:
    """The pose that a description means; `body` stands upright in the recording's world (vertical `up`) already.

    Raises:
        InputError: as `check_rough_pose`.
    """
    check_rough_pose(body, description, up)
    start = _named_pose(body, description.pose)
    if description.position is not None:
        start = placed(body, start, np.asarray(description.position, float))
    if description.heading is not None:
        start = turned(body, start, np.radians(description.heading), up)
    if description.landmarks:
        return fit_landmarks(body, up, start, description.landmarks, description.heading is not None)
    return start


def check_rough_pose(body: Body, description: PoseDescription, up: str) -> None:
    """Refuse a description that means no pose of a body.

    Raises:
        InputError: unknown pose, degree of freedom or landmark; too few landmarks; nothing that says where; a heading
            for a body that cannot turn about the vertical.
    """
    _named_pose(body, description.pose)
    if description.heading is not None and heading_dof(body, up) is None:
        raise InputError(
            f"heading: the body {body.name!r} has no degree of freedom about the vertical {up}; leave it out"
        )
    if description.landmarks:
        landmark_targets(body, description.landmarks)
    elif description.position is None:
        raise InputError(
            "the initial pose has neither `position` nor `landmarks`; give the root's position in metres, "
            f"or at least {MIN_LANDMARKS} landmarks"
        )


def fit_landmarks(
    body: Body,
    up: str,
    start: Float[Array, "dof"],
    landmarks: Mapping[str, tuple[float, float, float]],
    keep_heading: bool = False,
) -> Float[Array, "dof"]:
    """The pose whose landmarks lie nearest to the given points, by least squares from several headings.

    Raises:
        InputError: unknown landmark names, or fewer than four.
    """
    points = landmark_targets(body, landmarks)
    middle = np.mean(landmarks_of(body, start[None])[0, np.asarray(points.landmarks)], axis=0)
    start = placed(body, start, root_position(body, start) + np.mean(np.asarray(points.places, float), axis=0) - middle)
    angles = [None] if keep_heading else headings(NUM_HEADINGS)
    starts = np.stack([start if h is None else turned(body, start, float(h), up) for h in angles])
    far = jnp.asarray(ANYWHERE, starts.dtype)
    fitted, costs = fitted_to_points(body, jnp.asarray(starts), points, far, dof_spread(body))
    return jnp.asarray(np.asarray(fitted)[np.argmin(costs)])


def landmark_targets(body: Body, landmarks: Mapping[str, tuple[float, float, float]]) -> Points:
    """The named landmarks of the body and the points they should lie on.

    Raises:
        InputError: unknown landmark names, or fewer than four.
    """
    known = body.landmarks.names
    unknown = sorted(set(landmarks) - set(known))
    if unknown:
        raise InputError(
            f"unknown landmark {', '.join(unknown)}: the body {body.name!r} has {', '.join(known)}; "
            "rename it, or add it under `landmarks` of the body file"
        )
    if len(landmarks) < MIN_LANDMARKS:
        raise InputError(
            f"{counted(len(landmarks), 'landmark')} cannot fit the body {body.name!r}; "
            f"give at least {MIN_LANDMARKS}, well spread"
        )
    dtype = body.landmarks.offsets.dtype
    return Points(
        jnp.asarray(np.array([known.index(name) for name in landmarks])),
        jnp.asarray(np.array(list(landmarks.values())), dtype),
        jnp.asarray(np.full(len(landmarks), LANDMARK_NOISE), dtype),
        jnp.asarray(np.ones(len(landmarks)), dtype),
    )


def dof_spread(body: Body) -> Float[Array, "dof"]:
    """How far each degree of freedom may lie from the start pose."""
    spread = np.full(body.skeleton.num_dofs, POSE_SPREAD)
    spread[[dof for revolute in (False, True) for _, dof, _ in root_dofs(body, revolute)]] = ROOT_SPREAD
    return jnp.asarray(spread, body.skeleton.offsets.dtype)


def _named_pose(body: Body, pose: str | Mapping[str, float] | None) -> Float[Array, "dof"]:
    if pose is None:
        return body.poses["rest"]
    if isinstance(pose, str):
        if pose not in body.poses:
            raise InputError(f"unknown pose {pose!r}: the body {body.name!r} has {', '.join(sorted(body.poses))}")
        return body.poses[pose]
    values = body.poses["rest"]
    for name, value in pose.items():
        if name not in body.skeleton.dof_names:
            raise InputError(
                f"unknown degree of freedom {name!r} in the initial pose: the body {body.name!r} has "
                f"{', '.join(body.skeleton.dof_names)}"
            )
        values = values.at[body.skeleton.dof_names.index(name)].set(value)
    return values
