"""The poses of an actor's own skeleton that lie nearest to a recording's truth, and how far limbs of others are off."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.model.body import Attachments, Body, dof_slices
from sogjax.quality.markers import common_frames, joint_errors
from sogjax.quality.metrics import landmark_named, mean_per_frame
from sogjax.search.described_pose import MIN_LANDMARKS, fit_landmarks

Points = Float[np.ndarray, "frame point 3"]
Poses = Float[np.ndarray, "frame dof"]


def true_poses(body: Body, truth: GroundTruth, up: str) -> Poses:
    """Poses of a body (upright in the recording's world) for the truth of its subject; NaN where too little is known.

    The truth's joints that are landmarks of the body are fitted first. Its other points (markers, and joints that the
    body does not have) are then fixed to the body where they lie on average over the frames, and all are fitted.

    Raises:
        InputError: the truth and the body have fewer than four points in common.
    """
    points, names = known_points(truth)
    common = [k for k, name in enumerate(names) if name in body.landmarks.names]
    if len(common) < MIN_LANDMARKS:
        raise InputError(
            f"the truth's joints ({', '.join(truth.joint_names)}) have {len(common)} names in common with the "
            f"landmarks of {body.name!r}; name at least {MIN_LANDMARKS} of them alike"
        )
    poses = _followed(body, up, points[:, common], [names[k] for k in common])
    others = [k for k in range(len(names)) if k not in common and np.isfinite(points[:, k]).any()]
    if not others:
        return poses
    marked = _with_landmarks(body, poses, points[:, others], [names[k] for k in others])
    chosen = [*common, *others]
    return _followed(marked, up, points[:, chosen], [names[k] for k in chosen])


def known_points(truth: GroundTruth) -> tuple[Points, list[str]]:
    """The truth's joints and markers with their names, those of joints as a body writes them."""
    parts, names = [], []
    if truth.joints is not None:
        parts.append(truth.joints)
        names += [landmark_named(name) for name in truth.joint_names]
    if truth.markers is not None:
        parts.append(truth.markers)
        names += [f"marker {name}" for name in truth.marker_names]
    return np.concatenate(parts, axis=1), names


def _followed(body: Body, up: str, points: Points, names: Sequence[str]) -> Poses:
    """The pose of every frame, fitted from that of the frame before; from all headings where there is none."""
    poses = np.full((len(points), body.skeleton.num_dofs), np.nan)
    for k, of_frame in enumerate(points):
        known = np.flatnonzero(np.isfinite(of_frame).all(axis=1)).tolist()
        if len(known) < MIN_LANDMARKS:
            continue
        landmarks = {names[i]: (float(x), float(y), float(z)) for i in known for x, y, z in [of_frame[i]]}
        follows = k > 0 and bool(np.isfinite(poses[k - 1]).all())
        start = jnp.asarray(poses[k - 1], body.skeleton.offsets.dtype) if follows else body.poses["rest"]
        poses[k] = fit_landmarks(body, up, start, landmarks, keep_heading=follows)
    return poses


def _with_landmarks(body: Body, poses: Poses, points: Points, names: Sequence[str]) -> Body:
    """The body with further landmarks, each fixed to the joint of the blob nearest to it, at its usual place."""
    seen = np.isfinite(poses).all(axis=1)
    motion = motion_from_poses(body, poses[seen], 1.0)
    found = [_attached(motion, points[seen, k]) for k in range(len(names))]
    old = body.landmarks
    landmarks = Attachments(
        names=(*old.names, *names),
        joints=(*old.joints, *(joint for joint, _ in found)),
        offsets=jnp.concatenate([old.offsets, jnp.asarray([offset for _, offset in found], old.offsets.dtype)]),
    )
    return replace(body, landmarks=landmarks)


def _attached(motion: Motion, points: Float[np.ndarray, "frame 3"]) -> tuple[int, Float[np.ndarray, "3"]]:
    """The joint that a point moves with, and where in its frame the point lies (metres)."""
    present = np.isfinite(points).all(axis=1)
    distances = np.linalg.norm(motion.blob_means[present] - points[present, None], axis=-1) / motion.blob_sigma
    joint = int(motion.blob_joint[distances.mean(axis=0).argmin()])
    frames = motion.world_from_joint[present, joint]
    inside = np.einsum("tji,tj->ti", frames[:, :3, :3], points[present] - frames[:, :3, 3])
    return joint, np.median(inside, axis=0)


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
