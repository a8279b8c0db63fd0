"""The shape of a body as a clip tells it: its groups of lengths and sizes, and where joints lie within the flesh.

Which frames of a long clip tell a body's shape: those whose poses differ most, where the body was well seen.
"""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.model.body import Attachments, Body
from sogjax.model.bones import turning_places
from sogjax.model.farthest import farthest
from sogjax.model.rotation import world_from_upright
from sogjax.model.shape import ShapeModel
from sogjax.model.skeleton import Skeleton

PLACE_SPREAD = 0.015
"""Metres: how far a joint may lie from where the body file puts it within the flesh."""
WHOLE_SPREAD = 0.05
"""Expected deviation of the whole body's scale (logarithm): an actor has about the right size already."""
RIGID = 0.3
"""What is left of the usual spread of sizes, and of lengths at the ends of limbs. Blobs that grow or hide within a limb
please the energy of the pictures, whatever the body is like."""


class ClipShape(eqx.Module):
    """A body as a function of shape parameters: those of `ShapeModel`, then places of joints in metres.

    A joint that moves leaves the flesh around it where it is in the rest pose: what hangs on it moves back by as much.
    Left and right mirror each other.
    """

    groups: ShapeModel
    joint_moves: Float[Array, "joint 3 place"]
    blob_moves: Float[Array, "blob 3 place"]
    landmark_moves: Float[Array, "landmark 3 place"]
    spread: Float[Array, "shape"]
    """Expected deviation of each parameter from 0."""
    names: tuple[str, ...] = eqx.field(static=True)

    @classmethod
    def from_body(cls, body: Body, up: str, symmetric: bool = True) -> "ClipShape":
        """The shape of a body that stands upright in a world with the vertical `up`."""
        groups = ShapeModel.from_body(body, symmetric)
        moves, names = _place_moves(body, up, symmetric)
        dtype = body.blob_sigmas.dtype
        lengths = np.asarray(groups.joint_groups).any(axis=0)
        spread = np.array(groups.spread, float) * np.where(lengths, 1.0, RIGID)
        spread[0] = WHOLE_SPREAD
        of_joints, of_blobs, of_landmarks = (jnp.asarray(part, dtype) for part in moves)
        return cls(
            groups,
            of_joints,
            of_blobs,
            of_landmarks,
            jnp.asarray(np.concatenate([spread, np.full(len(names), PLACE_SPREAD)]), dtype),
            (*groups.names, *names),
        )

    @property
    def num_params(self) -> int:
        """Number of shape parameters."""
        return len(self.names)

    def shaped(self, params: Float[Array, "shape"]) -> Body:
        """The body with these parameters; all 0 is the body that it was made from."""
        count = self.groups.num_shape_params
        body, places = self.groups.shaped(params[:count]), params[count:]
        moved = lambda offsets, moves: offsets + jnp.matmul(moves, places, precision="highest")
        return eqx.tree_at(
            lambda b: (b.skeleton.offsets, b.blobs.offsets, b.landmarks.offsets),
            body,
            (
                moved(body.skeleton.offsets, self.joint_moves),
                moved(body.blobs.offsets, self.blob_moves),
                moved(body.landmarks.offsets, self.landmark_moves),
            ),
        )


def _place_moves(
    body: Body, up: str, symmetric: bool
) -> tuple[list[Float[np.ndarray, "point 3 place"]], tuple[str, ...]]:
    """How joints, blobs and landmarks move by one metre of each place parameter, and the parameters' names."""
    upright = world_from_upright(up)
    counts = (body.skeleton.num_joints, len(body.blobs.names), len(body.landmarks.names))
    columns: list[list[np.ndarray]] = []
    names: list[str] = []
    for name, sides in _by_name(turning_places(body), symmetric).items():
        central = not name.startswith(("left_", "right_")) and len(sides) == 1
        for axis, letter in enumerate("xyz"):
            if central and letter == "y":  # nothing lies beside the midline
                continue
            moves = [np.zeros((count, 3)) for count in counts]
            for sign, joints in sides:
                direction = upright[:, axis] * (sign if letter == "y" else 1.0)
                _move(body, joints, direction, moves)
            columns.append(moves)
            names.append(f"{name}.{letter}")
    stacked = [np.stack(part, axis=-1) for part in zip(*columns, strict=True)] if columns else []
    return stacked or [np.zeros((count, 3, 0)) for count in counts], tuple(names)


def _by_name(places: list[tuple[str, list[int]]], symmetric: bool) -> dict[str, list[tuple[float, list[int]]]]:
    """The places that move together: a sign of the sideways direction, and their joints."""
    together: dict[str, list[tuple[float, list[int]]]] = {}
    for name, joints in places:
        side = next((side for side in ("left_", "right_") if name.startswith(side)), "")
        key = name.removeprefix(side) if symmetric else name
        together.setdefault(key, []).append((-1.0 if side == "right_" else 1.0, joints))
    return together


def _move(body: Body, joints: list[int], direction: Float[np.ndarray, "3"], moves: list[np.ndarray]) -> None:
    """Move a place, and what hangs on it back."""
    of_joints, of_blobs, of_landmarks = moves
    of_joints[joints[0]] += direction
    for child, parent in enumerate(body.skeleton.parents):
        if parent in joints and child not in joints:
            of_joints[child] -= direction
    _move_back(body.blobs, joints, direction, of_blobs)
    _move_back(body.landmarks, joints, direction, of_landmarks)


def _move_back(points: Attachments, joints: list[int], direction: Float[np.ndarray, "3"], moves: np.ndarray) -> None:
    """Leave points where they are; those that are the joint itself (no offset) stay with it."""
    offsets = np.asarray(points.offsets, float)
    for k, joint in enumerate(points.joints):
        if joint in joints and np.any(offsets[k] != 0.0):
            moves[k] -= direction


WELL_SEEN = 0.9
"""Share of the median energy of the frames around. Where it is less, a limb may be lost, which bends the shape."""
AROUND = 30
"""Frames to both sides."""


def frames_by_spread(
    skeleton: Skeleton,
    poses: Float[np.ndarray, "frame dof"],
    similarity: Float[np.ndarray, "frame"],
    count: int,
) -> Int[np.ndarray, "chosen"]:
    """Rows of `poses`, increasing: all where there are no more than `count`, less those that were badly seen.

    Farthest-point choice by joint angles in units of their ranges; where the body is and which way it looks is no
    matter. A similarity that is NaN leaves nothing out.
    """
    rows = np.flatnonzero(_well_seen(np.asarray(similarity, float)))
    if len(rows) <= count:
        return rows
    bent = _bent(skeleton, poses[rows])
    first = int(np.argmin(np.linalg.norm(bent - np.median(bent, axis=0), axis=1)))
    return rows[farthest(bent, count, first)]


def _bent(skeleton: Skeleton, poses: Float[np.ndarray, "frame dof"]) -> Float[np.ndarray, "frame limited"]:
    """The degrees of freedom that have limits, in units of their ranges."""
    spans = np.asarray(skeleton.dof_upper, float) - np.asarray(skeleton.dof_lower, float)
    limited = np.isfinite(spans) & (spans > 0.0)
    return poses[:, limited] / spans[limited]


def _well_seen(similarity: Float[np.ndarray, "frame"]) -> np.ndarray:
    """Frames that are explained about as well as those around them."""
    if np.isnan(similarity).any():
        return np.ones(len(similarity), bool)
    count = len(similarity)
    around = [np.median(similarity[max(k - AROUND, 0) : k + AROUND + 1]) for k in range(count)]
    return similarity >= WELL_SEEN * np.array(around)
