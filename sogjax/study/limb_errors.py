"""How far the limbs of poses are from the truth of a recording, frame by frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import motion_from_poses
from sogjax.model.body import Body, dof_slices
from sogjax.quality.markers import common_frames, joint_errors
from sogjax.quality.metrics import mean_per_frame

ENDS = {"elbow": "arm", "wrist": "arm", "hand": "arm", "knee": "leg", "ankle": "leg", "toe": "leg", "foot": "leg"}
"""What belongs to a limb; other joints are the trunk's."""


@dataclass(frozen=True)
class LimbErrors:
    """Mean distances of joints to the truth (metres); NaN where the truth is not known."""

    names: tuple[str, ...]
    limbs: Float[np.ndarray, "frame limb"]
    mean: Float[np.ndarray, "frame"]
    """Over all joints."""


def limb_errors(
    bodies: Sequence[Body],
    truth: GroundTruth,
    frames: Int[np.ndarray, "frame"],
    poses: Float[np.ndarray, "frame dof"],
) -> LimbErrors:
    """The errors of poses of several bodies, upright in the world, beside each other; `frames` are the recording's.

    Raises:
        InputError: the truth knows none of these frames.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    known = np.asarray(np.isfinite(poses).all(axis=1))
    for body, part in zip(bodies, dof_slices(bodies), strict=True):
        of_body = truth.subject(body.name) if truth.subjects else truth
        motion = motion_from_poses(body, np.where(known[:, None], poses[:, part], 0.0), truth.fps, frame=frames)
        found = joint_errors(motion, of_body)
        if found is not None:
            subject = f"{body.name}/" if len(bodies) > 1 else ""
            names += [subject + name for name in found.names]
            rows, _ = common_frames(motion, of_body)
            column = np.full((len(frames), len(found.names)), np.nan)
            column[rows] = np.where(known[rows, None], found.errors, np.nan)
            columns.append(column)
    errors = np.concatenate([*columns, np.zeros((len(frames), 0))], axis=1)
    of_joint = [limb_of(name) for name in names]
    limbs = tuple(dict.fromkeys(of_joint))
    means = [mean_per_frame(errors[:, [k for k, one in enumerate(of_joint) if one == limb]]) for limb in limbs]
    return LimbErrors(limbs, np.stack([*means], axis=1), mean_per_frame(errors))


def limb_of(joint: str) -> str:
    """The limb of a truth's joint: `left arm` of `l_wrist`, `anna/right leg` of `anna/right_knee`."""
    subject, slash, name = joint.rpartition("/")
    side, _, part = name.lower().partition("_")
    limb = next((limb for end, limb in ENDS.items() if part.startswith(end)), None)
    whole = {"l": "left", "r": "right"}.get(side, side)
    return subject + slash + (f"{whole} {limb}" if limb and whole in ("left", "right") else "trunk")
