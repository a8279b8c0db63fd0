"""Poses turned as a whole: about the vertical, and to lie or stand on the head."""

import itertools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sogjax.model.body import Body
from sogjax.tracking.initial_pose import heading_dof, root_turns

STEP = np.pi / 6.0
"""Radians between the values of each turning degree of freedom that are tried."""
TILTED = 0.4
"""Radians: how far from the wanted direction a body's vertical may be."""
DIFFERENT = 0.45
"""Radians between turns that count as different."""


def turned_to(
    body: Body, poses: Sequence[Float[np.ndarray, "dof"]], headings: Float[np.ndarray, "heading"], up: str
) -> Float[np.ndarray, "start dof"]:
    """Every pose at every heading (radians about the vertical)."""
    turn = heading_dof(body, up)
    if turn is None:
        return np.stack(poses)
    starts = np.repeat(np.stack(poses), len(headings), axis=0)
    starts[:, turn[0]] = np.tile(headings / turn[1], len(poses))
    return starts


def turns_with_vertical(
    body: Body,
    poses: Sequence[Float[np.ndarray, "dof"]],
    vertical: Float[np.ndarray, "3"],
    wanted: Float[np.ndarray, "3"],
) -> Float[np.ndarray, "start dof"]:
    """Poses turned about the root so that what is its vertical in the rest pose points in a wanted direction.

    All headings of it, about half a radian apart.
    """
    turns = root_turns(body)
    values = np.arange(-np.pi, np.pi - 1e-6, STEP)
    tables = [np.array([about(axis, value) for value in values]) for axis, _, _ in turns]
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
        if all(_angle(rotation, other) > DIFFERENT for other, _ in found):
            found.append((rotation, angles))
    turned_poses = [pose.copy() for _ in found for pose in poses]
    for k, (_, angles) in enumerate(found):
        for pose in turned_poses[k * len(poses) : (k + 1) * len(poses)]:
            for (_, dof, weight), value in zip(turns, angles, strict=True):
                pose[dof] = value / weight
    return np.stack(turned_poses)


def about(axis: Float[np.ndarray, "3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """The rotation about an axis (Rodrigues)."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def _angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arccos(np.clip(0.5 * (np.trace(a.T @ b) - 1.0), -1.0, 1.0)))
