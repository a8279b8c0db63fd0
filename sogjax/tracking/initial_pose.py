"""The pose of the first frame from a rough description: a named pose and a place, or a handful of landmarks."""

from collections.abc import Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Float

from sogjax.data.initial_pose import InitialPose
from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.model.frames import axis_vector
from sogjax.sentences import counted

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
    for joint, dof, weight in _root_dofs(body, revolute=False):
        axis = np.asarray(body.skeleton.axes[joint], float)
        offset = np.asarray(body.skeleton.offsets[joint], float)
        pose = pose.at[dof].set(float(axis @ (position - offset)) / weight)
    return pose


def centred(body: Body, pose: Float[Array, "dof"], centre: Float[np.ndarray, "3"]) -> Float[Array, "dof"]:
    """The pose moved so that the body's centre lies at a point (metres, world)."""
    step = jnp.asarray(centre - np.asarray(body_centre(body, pose), float), pose.dtype)
    return pose + jnp.sum(shifts(body) * step[None, :], axis=1)


def shifts(body: Body) -> Float[Array, "dof 3"]:
    """What has to be added to a pose for each metre by which the whole body moves (world)."""
    table = np.zeros((body.skeleton.num_dofs, 3))
    for joint, dof, weight in _root_dofs(body, revolute=False):
        table[dof] = np.asarray(body.skeleton.axes[joint], float) / weight
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
def _joint_frames(body: Body, pose: Float[Array, "dof"]) -> Float[Array, "joint 4 4"]:
    return body.skeleton.world_from_joint(pose)


def turned(body: Body, pose: Float[Array, "dof"], heading: float, up: str) -> Float[Array, "dof"]:
    """The pose turned to a heading (radians about the vertical; 0 is the rest pose's)."""
    turn = heading_dof(body, up)
    return pose if turn is None else pose.at[turn[0]].set(heading / turn[1])


def heading_dof(body: Body, up: str) -> tuple[int, float] | None:
    """The degree of freedom that turns the whole body about the vertical, and radians for each unit of it."""
    vertical = axis_vector(up)
    for joint, dof, weight in _root_dofs(body, revolute=True):
        along = float(np.asarray(body.skeleton.axes[joint], float) @ vertical)
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
    indices, targets = landmark_targets(body, landmarks)
    centre = jnp.mean(targets, axis=0)
    middle = jnp.mean(jax.jit(Body.posed_landmarks)(body, start)[indices], axis=0)
    start = placed(body, start, root_position(body, start) + np.asarray(centre - middle, float))
    headings = [None] if keep_heading else np.arange(NUM_HEADINGS) * 2.0 * np.pi / NUM_HEADINGS - np.pi
    starts = jnp.stack([start if h is None else turned(body, start, float(h), up) for h in headings])
    fitted, costs = _fit_all(body, starts, indices, targets, dof_spread(body))
    return fitted[jnp.argmin(jnp.where(jnp.isfinite(costs), costs, jnp.inf))]


def landmark_targets(
    body: Body, landmarks: Mapping[str, tuple[float, float, float]]
) -> tuple[Array, Float[Array, "landmark 3"]]:
    """Indices of the named landmarks in the body and the points they should lie on.

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
    indices = jnp.array([known.index(name) for name in landmarks])
    return indices, jnp.array(list(landmarks.values()), body.landmarks.offsets.dtype)


def dof_spread(body: Body) -> Float[Array, "dof"]:
    """How far each degree of freedom may lie from the start pose."""
    spread = jnp.full(body.skeleton.num_dofs, POSE_SPREAD, body.skeleton.offsets.dtype)
    root = [dof for revolute in (False, True) for _, dof, _ in _root_dofs(body, revolute)]
    return spread.at[jnp.array(root, int)].set(ROOT_SPREAD)


@jax.jit
def _fit_all(
    body: Body,
    starts: Float[Array, "start dof"],
    indices: Array,
    targets: Float[Array, "landmark 3"],
    spread: Float[Array, "dof"],
) -> tuple[Float[Array, "start dof"], Float[Array, "start"]]:
    solver = optx.LevenbergMarquardt(rtol=1e-4, atol=1e-4)
    lower, upper = body.skeleton.joint_limits()

    def fit(start):
        def residuals(pose, _):
            distances = (body.posed_landmarks(pose)[indices] - targets) / LANDMARK_NOISE
            prior = (pose - start) / spread
            params = body.skeleton.joint_params(pose)
            limits = jnp.maximum(lower - params, 0.0) + jnp.maximum(params - upper, 0.0)
            return distances, prior, 30.0 * limits

        result = optx.least_squares(residuals, solver, start, max_steps=100, throw=False)
        cost = jnp.sum(jnp.concatenate([part.reshape(-1) ** 2 for part in residuals(result.value, None)]))
        return result.value, cost

    return jax.vmap(fit)(starts)


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
