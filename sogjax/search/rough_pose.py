"""The pose of the first frame from a rough description: a named pose and a place, or a handful of landmarks."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.errors import InputError, counted
from sogjax.io.initial_pose import InitialPose
from sogjax.model.body import Body
from sogjax.model.rotation import axis_vector
from sogjax.search.point_fit import ANYWHERE, Points, fitted_to_points

LANDMARK_NOISE = 0.03
"""Metres: what a landmark is expected to be off."""
POSE_SPREAD = 0.5
"""Radians: how far joint angles lie from the start pose. Large against what landmarks say of most angles; it decides
where they say next to nothing, as of the twist of a straight arm."""
ROOT_SPREAD = 10.0
"""Radians and metres: nothing is known of place and heading."""
VERTICAL = 0.99
"""Cosine above which an axis counts as vertical."""
NUM_HEADINGS = 12
MIN_LANDMARKS = 4


def rough_pose(body: Body, description: InitialPose, up: str) -> Float[Array, "dof"]:
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


def check_rough_pose(body: Body, description: InitialPose, up: str) -> None:
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


def placed(body: Body, pose: Float[Array, "dof"], position: Float[np.ndarray, "3"]) -> Float[Array, "dof"]:
    """The pose with the root at a position (metres, world)."""
    found, axes, offsets = (
        np.array(pose),
        np.asarray(body.skeleton.axes, float),
        np.asarray(body.skeleton.offsets, float),
    )
    for joint, dof, weight in _root_dofs(body, revolute=False):
        found[dof] = float(axes[joint] @ (position - offsets[joint])) / weight
    return jnp.asarray(found)


def centred(body: Body, pose: Float[Array, "dof"], centre: Float[np.ndarray, "3"]) -> Float[Array, "dof"]:
    """The pose moved so that the body's centre lies at a point (metres, world)."""
    step = centre - np.asarray(body_centre(body, pose), float)
    return jnp.asarray(np.asarray(pose) + np.asarray(shifts(body)) @ step, pose.dtype)


def shifts(body: Body) -> Float[Array, "dof 3"]:
    """What has to be added to a pose for each metre by which the whole body moves (world)."""
    table, axes = np.zeros((body.skeleton.num_dofs, 3)), np.asarray(body.skeleton.axes, float)
    for joint, dof, weight in _root_dofs(body, revolute=False):
        table[dof] = axes[joint] / weight
    return jnp.asarray(table, body.skeleton.offsets.dtype)


@eqx.filter_jit
def body_centre(body: Body, pose: Float[Array, "dof"]) -> Float[Array, "3"]:
    """The centre of a body's blobs (metres, world), weighted by the areas they cover in a picture."""
    blobs = body.posed_blobs(pose)
    area = blobs.sigmas**2
    return jnp.sum(blobs.means * area[:, None], axis=0) / jnp.sum(area)


def root_position(body: Body, pose: Float[Array, "dof"]) -> Float[np.ndarray, "3"]:
    """Where the root is in a pose (metres, world): the end of the chain of joints that have no offset."""
    offsets = np.asarray(body.skeleton.offsets)
    chain = _root_joints(body)
    at_root = [joint for joint in chain[1:] if np.linalg.norm(offsets[joint]) > 1e-9]
    last = chain[chain.index(at_root[0]) - 1] if at_root else chain[-1]
    return np.asarray(_joint_frames(body, pose)[last, :3, 3], float)


def root_rotation(body: Body, pose: Float[Array, "dof"]) -> Float[np.ndarray, "3 3"]:
    """How the trunk is turned in a pose: the rotation of the joint where the tree first branches."""
    return np.asarray(_joint_frames(body, pose)[_root_joints(body)[-1], :3, :3], float)


@jax.jit
def _landmarks_in(body: Body, pose: Float[Array, "dof"]) -> Float[Array, "landmark 3"]:
    return body.posed_landmarks(pose)


def _posed_landmarks(body: Body, pose: Float[Array, "dof"]) -> Float[np.ndarray, "landmark 3"]:
    return np.asarray(_landmarks_in(body, pose), float)


@jax.jit
def _joint_frames(body: Body, pose: Float[Array, "dof"]) -> Float[Array, "joint 4 4"]:
    return body.skeleton.world_from_joint(pose)


def turned(body: Body, pose: Float[Array, "dof"], heading: float, up: str) -> Float[Array, "dof"]:
    """The pose turned to a heading (radians about the vertical; 0 is the rest pose's)."""
    turn = heading_dof(body, up)
    if turn is None:
        return pose
    found = np.array(pose)
    found[turn[0]] = heading / turn[1]
    return jnp.asarray(found)


def heading_dof(body: Body, up: str) -> tuple[int, float] | None:
    """The degree of freedom that turns the whole body about the vertical, and radians for each unit of it."""
    vertical = axis_vector(up)
    axes = np.asarray(body.skeleton.axes, float)
    for joint, dof, weight in _root_dofs(body, revolute=True):
        along = float(axes[joint] @ vertical)
        if abs(along) > VERTICAL:
            return dof, weight * float(np.sign(along))
    return None


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
    middle = np.mean(_posed_landmarks(body, start)[np.asarray(points.landmarks)], axis=0)
    start = placed(body, start, root_position(body, start) + np.mean(np.asarray(points.places, float), axis=0) - middle)
    headings = [None] if keep_heading else np.arange(NUM_HEADINGS) * 2.0 * np.pi / NUM_HEADINGS - np.pi
    starts = np.stack([start if h is None else turned(body, start, float(h), up) for h in headings])
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
    spread[[dof for revolute in (False, True) for _, dof, _ in _root_dofs(body, revolute)]] = ROOT_SPREAD
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


def _root_joints(body: Body) -> list[int]:
    """The chain of joints from the root down to the first one where the tree branches."""
    parents = body.skeleton.parents
    chain = [parents.index(-1)]
    while len(children := [j for j, parent in enumerate(parents) if parent == chain[-1]]) == 1:
        chain.append(children[0])
    return chain


def _root_dofs(body: Body, revolute: bool) -> list[tuple[int, int, float]]:
    """(joint, dof, weight) of the root chain's joints that turn (or slide)."""
    transform = np.asarray(body.skeleton.parameter_transform)
    kinds = np.asarray(body.skeleton.revolute)
    found = []
    for joint in _root_joints(body):
        if bool(kinds[joint]) is revolute and np.any(transform[joint]):
            dof = int(np.argmax(np.abs(transform[joint])))
            found.append((joint, dof, float(transform[joint, dof])))
    return found


def root_turns(body: Body) -> list[tuple[Float[np.ndarray, "3"], int, float]]:
    """(axis in the rest pose, dof, weight) of the joints of the root that turn the whole body, in their order."""
    axes = np.asarray(body.skeleton.axes, float)
    branching = root_position(body, body.poses["rest"])
    frames = np.asarray(_joint_frames(body, body.poses["rest"]), float)
    found = []
    for joint, dof, weight in _root_dofs(body, revolute=True):
        at_root = np.linalg.norm(frames[joint, :3, 3] - branching) < 1e-6
        if at_root:
            found.append((frames[joint, :3, :3] @ axes[joint], dof, weight))
    return found
