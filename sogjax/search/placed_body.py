"""Where a body is in a pose, and poses moved and turned as a whole: about the vertical, to lie, upside down."""

import itertools
from collections.abc import Callable, Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.model.body import Body
from sogjax.model.program import compiled
from sogjax.model.rotation import axis_vector


def means_of(body: Body, poses: Float[np.ndarray, "start dof"]) -> Float[np.ndarray, "start blob 3"]:
    """The blobs of a body in poses (metres, world)."""
    return _padded(_means, body, poses)


def _padded(
    of: Callable[[Body, Array], Array], body: Body, poses: Float[np.ndarray, "start dof"]
) -> Float[np.ndarray, "start ..."]:
    """What `of` gives for each pose, so many poses at a time that one program serves any number."""
    size = 64
    padded = np.concatenate([poses, np.repeat(poses[-1:], -len(poses) % size, axis=0)])
    parts = [np.asarray(of(body, jnp.asarray(padded[k : k + size]))) for k in range(0, len(poses), size)]
    return np.concatenate(parts)[: len(poses)]


@compiled
def _means(body: Body, poses: Array) -> Float[Array, "start blob 3"]:
    return jax.vmap(lambda pose: body.posed_blobs(pose).means)(poses)


def landmarks_of(body: Body, poses: Float[Array, "start dof"]) -> Float[np.ndarray, "start landmark 3"]:
    """The landmarks of a body in poses (metres, world)."""
    return np.asarray(_landmarks(body, poses), float)


@compiled
def _landmarks(body: Body, poses: Array) -> Float[Array, "start landmark 3"]:
    return jax.vmap(body.posed_landmarks)(poses)


def centres_of(body: Body, poses: Float[np.ndarray, "start dof"]) -> Float[np.ndarray, "start 3"]:
    """The middle of a body in poses (metres, world), weighted by the areas that its blobs cover in a picture."""
    areas = np.asarray(body.blob_sigmas) ** 2
    return np.einsum("sbi,b->si", means_of(body, poses), areas / areas.sum())


def uprightness(body: Body, poses: Float[np.ndarray, "start dof"], up: str) -> Float[np.ndarray, "start"]:
    """The cosine of the angle between the vertical and what is its vertical at rest: -1 upside down."""
    vertical, root = axis_vector(up), _root_joints(body)[-1]
    rest = _joint_frames(body, body.poses["rest"])[root, :3, :3]
    turns = _padded(_posed_joints, body, poses)[:, root, :3, :3] @ rest.T
    return np.einsum("i,sij,j->s", vertical, turns, vertical)


def centred(
    body: Body, poses: Float[np.ndarray, "start dof"], centre: Float[np.ndarray, "3"]
) -> Float[np.ndarray, "start dof"]:
    """Poses moved so that the body's middle is at a point (metres, world)."""
    shifts, axes = np.zeros((body.skeleton.num_dofs, 3)), np.asarray(body.skeleton.axes, float)
    for joint, dof, weight in root_dofs(body, revolute=False):
        shifts[dof] = axes[joint] / weight
    return (poses + (centre[None] - centres_of(body, poses)) @ shifts.astype(np.float32).T).astype(poses.dtype)


def placed(body: Body, pose: Float[Array, "dof"], position: Float[np.ndarray, "3"]) -> Float[Array, "dof"]:
    """The pose with the root at a position (metres, world)."""
    axes, offsets = np.asarray(body.skeleton.axes, float), np.asarray(body.skeleton.offsets, float)
    found = np.array(pose)
    for joint, dof, weight in root_dofs(body, revolute=False):
        found[dof] = float(axes[joint] @ (position - offsets[joint])) / weight
    return jnp.asarray(found)


def turned(body: Body, pose: Float[Array, "dof"], heading: float, up: str) -> Float[Array, "dof"]:
    """The pose turned to a heading (radians about the vertical; 0 is the rest pose's)."""
    turn = heading_dof(body, up)
    if turn is None:
        return pose
    found = np.array(pose)
    found[turn[0]] = heading / turn[1]
    return jnp.asarray(found)


def headings(count: int) -> Float[np.ndarray, "heading"]:
    """All around the vertical in equal steps (radians)."""
    return np.arange(count) * 2.0 * np.pi / count - np.pi


def turned_to(
    body: Body, poses: Sequence[Float[np.ndarray, "dof"]], angles: Float[np.ndarray, "heading"], up: str
) -> Float[np.ndarray, "start dof"]:
    """Every pose at every heading (radians about the vertical)."""
    turn = heading_dof(body, up)
    if turn is None:
        return np.stack(poses)
    starts = np.repeat(np.stack(poses), len(angles), axis=0)
    starts[:, turn[0]] = np.tile(angles / turn[1], len(poses))
    return starts


def heading_dof(body: Body, up: str) -> tuple[int, float] | None:
    """The degree of freedom that turns the whole body about the vertical, and radians for each unit of it."""
    vertical, axes = axis_vector(up), np.asarray(body.skeleton.axes, float)
    for joint, dof, weight in root_dofs(body, revolute=True):
        along = float(axes[joint] @ vertical)
        if abs(along) > 0.99:  # the cosine above which an axis counts as vertical
            return dof, weight * float(np.sign(along))
    return None


STEP = np.pi / 6.0
"""Radians between the values of each turning degree of freedom that are tried."""
TILTED = 0.4
"""Radians: how far from the wanted direction a body's vertical may be."""
OTHER_TURN = 0.45
"""Radians between turns that count as different."""


def turns_with_vertical(
    body: Body,
    poses: Sequence[Float[np.ndarray, "dof"]],
    vertical: Float[np.ndarray, "3"],
    wanted: Float[np.ndarray, "3"],
) -> Float[np.ndarray, "start dof"]:
    """Poses turned about the root so that what is its vertical in the rest pose points in a wanted direction.

    The poses are turned to all headings with that vertical, about half a radian apart.
    """
    turns = _root_turns(body)
    values = np.arange(-np.pi, np.pi - 1e-6, STEP)
    tables = [np.array([_about(axis, value) for value in values]) for axis, _, _ in turns]
    tried = []
    for combination in itertools.product(range(len(values)), repeat=len(turns)):
        rotation = np.eye(3)
        for table, index in zip(tables, combination, strict=True):
            rotation = rotation @ table[index]
        off = float(np.arccos(np.clip(rotation @ vertical @ wanted, -1.0, 1.0)))
        if off < TILTED:
            tried.append((off, rotation, values[list(combination)]))
    found: list[tuple[np.ndarray, np.ndarray]] = []
    for _, rotation, angles in sorted(tried, key=lambda each: each[0]):
        if all(_angle(rotation, other) > OTHER_TURN for other, _ in found):
            found.append((rotation, angles))
    starts = np.tile(np.stack(poses), (len(found), 1))
    for k, (_, dof, weight) in enumerate(turns):
        starts[:, dof] = np.repeat([angles[k] / weight for _, angles in found], len(poses))
    return starts


def _root_turns(body: Body) -> list[tuple[Float[np.ndarray, "3"], int, float]]:
    """The joints of the root that turn the whole body, in their order: axis in the rest pose, dof, weight."""
    axes, frames = np.asarray(body.skeleton.axes, float), _joint_frames(body, body.poses["rest"])
    root = root_position(body, body.poses["rest"])
    return [
        (frames[joint, :3, :3] @ axes[joint], dof, weight)
        for joint, dof, weight in root_dofs(body, revolute=True)
        if np.linalg.norm(frames[joint, :3, 3] - root) < 1e-6
    ]


def _about(axis: Float[np.ndarray, "3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """The rotation about an axis (Rodrigues)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arccos(np.clip(0.5 * (np.trace(a.T @ b) - 1.0), -1.0, 1.0)))


def root_position(body: Body, pose: Float[Array, "dof"]) -> Float[np.ndarray, "3"]:
    """The root's place in a pose (metres, world): the end of the chain of joints that have no offset."""
    offsets = np.asarray(body.skeleton.offsets)
    chain = _root_joints(body)
    at_root = [joint for joint in chain[1:] if np.linalg.norm(offsets[joint]) > 1e-9]
    last = chain[chain.index(at_root[0]) - 1] if at_root else chain[-1]
    return _joint_frames(body, pose)[last, :3, 3]


def root_rotations(body: Body, poses: Float[np.ndarray, "pose dof"]) -> Float[np.ndarray, "pose 3 3"]:
    """The turn of the trunk in each pose: the rotation of the joint where the tree first branches."""
    return _padded(_posed_joints, body, poses)[:, _root_joints(body)[-1], :3, :3].astype(float)


def _joint_frames(body: Body, pose: Float[Array, "dof"]) -> Float[np.ndarray, "joint 4 4"]:
    return _padded(_posed_joints, body, np.asarray(pose)[None])[0].astype(float)


@compiled
def _posed_joints(body: Body, poses: Float[Array, "start dof"]) -> Float[Array, "start joint 4 4"]:
    return jax.vmap(body.skeleton.world_from_joint)(poses)


def root_dofs(body: Body, revolute: bool) -> list[tuple[int, int, float]]:
    """The joints of the root's chain that turn (or slide): joint, degree of freedom, weight."""
    transform = np.asarray(body.skeleton.parameter_transform)
    kinds = np.asarray(body.skeleton.revolute)
    found = []
    for joint in _root_joints(body):
        if bool(kinds[joint]) is revolute and np.any(transform[joint]):
            dof = int(np.argmax(np.abs(transform[joint])))
            found.append((joint, dof, float(transform[joint, dof])))
    return found


def _root_joints(body: Body) -> list[int]:
    """The chain of joints from the root down to the first one where the tree branches."""
    parents = body.skeleton.parents
    chain = [parents.index(-1)]
    while len(children := [j for j, parent in enumerate(parents) if parent == chain[-1]]) == 1:
        chain.append(children[0])
    return chain
