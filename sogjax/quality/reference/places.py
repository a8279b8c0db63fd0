"""Another system's world and bones laid on ours: the rotations that fit best, and the distances that remain."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from sogjax.io.export.angles import SEGMENT_JOINTS, segment_angles
from sogjax.io.export.bones import world_turn
from sogjax.io.motion import Motion
from sogjax.quality.markers import PointErrors
from sogjax.quality.reference.names import Points


def point_errors(ours: Points, theirs: Points, rows: Bool[np.ndarray, "frame"]) -> PointErrors | None:
    """Distances of their points from ours in the frames `rows`, metres; None without any point."""
    if not theirs:
        return None
    errors = [np.linalg.norm(ours[name][rows] - values[rows], axis=-1) for name, values in theirs.items()]
    return PointErrors(tuple(theirs), tuple(theirs), np.stack(errors, axis=1))


def placed_errors(
    ours: Points, theirs: Points, rows: Bool[np.ndarray, "frame"]
) -> tuple[Float[np.ndarray, "3 3"] | None, PointErrors | None]:
    """The rotation of their world that lays all points best on ours (Kabsch), and the distances that remain."""
    if len(theirs) < 3:
        return None, None
    a = np.stack([ours[name][rows] for name in theirs], axis=1)
    b = np.stack([values[rows] for values in theirs.values()], axis=1)
    known = np.isfinite(b).all(axis=-1)
    middle_a, middle_b = a[known].mean(axis=0), b[known].mean(axis=0)
    turn = _best_turn((b[known] - middle_b).T @ (a[known] - middle_a))
    placed = {name: (values - middle_b) @ turn.T + middle_a for name, values in theirs.items()}
    return turn, point_errors(ours, placed, rows)


def _best_turn(products: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """The rotation R with the largest trace of R @ products."""
    u, _, vt = np.linalg.svd(products)
    return vt.T @ np.diag([1.0, 1.0, np.linalg.det(vt.T @ u.T)]) @ u.T


def _nearest_turns(matrices: Float[np.ndarray, "frame 3 3"]) -> Float[np.ndarray, "frame 3 3"]:
    """The rotations nearest to matrices between rotations; NaN stays."""
    known = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    u, _, vt = np.linalg.svd(np.where(known[:, None, None], matrices, np.eye(3)))
    signs = np.stack([np.ones(len(u)), np.ones(len(u)), np.linalg.det(u @ vt)], axis=-1)
    return np.where(known[:, None, None], (u * signs[:, None, :]) @ vt, np.nan)


def calibrated_angles(
    motion: Motion,
    theirs: Mapping[str, Float[np.ndarray, "frame 3 3"]],
    turn: Float[np.ndarray, "3 3"],
    rows: Bool[np.ndarray, "frame"],
) -> dict[str, Float[np.ndarray, "frame"]]:
    """Their joint angles (degrees), with each bone's own axes turned to ours where they fit best over all frames.

    `theirs` are their worlds from our segments, between two of their frames perhaps no rotations; `turn` is our world
    from theirs.
    """
    joints = motion.joint_names.tolist()
    to_y = world_turn(motion.up, "y")
    whole, known = {}, rows
    for segment, turns in theirs.items():
        if SEGMENT_JOINTS[segment] not in joints:
            continue
        ours = to_y @ motion.world_from_joint[:, joints.index(SEGMENT_JOINTS[segment]), :3, :3].astype(float) @ to_y.T
        placed = turn @ _nearest_turns(turns)
        here: np.ndarray = rows & np.isfinite(turns).all(axis=(1, 2))
        if here.any():
            axes = _best_turn(np.einsum("tji,tjk->ik", ours[here], placed[here]))
            whole[segment] = np.where(here[:, None, None], placed, np.eye(3)) @ axes
            known = known & here
    return {name: np.where(known, values, np.nan) for name, values in segment_angles(whole, "y").items()}
