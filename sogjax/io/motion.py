"""Motion: what tracking finds, one pose per frame and all that follows from it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.errors import InputError
from sogjax.io.export.write import export_motion
from sogjax.io.motion_data import DEFAULT_UP, FORMAT_VERSION, MotionData, per_frame_fields
from sogjax.io.npz_file import bool_array, finite_array, float_array, int_array, number, read_npz, text_array
from sogjax.model.body import Body
from sogjax.model.program import compiled
from sogjax.model.rotation import UP_AXES

FRAMES_AT_ONCE = 8
"""Joint frames and blobs are computed in blocks of so many frames, so that one program serves motions of any length."""


class Motion(MotionData):
    """The motion of one actor, which can be written in the formats of other programs; its fields are `MotionData`'s."""

    def save(self, path: str | Path) -> None:
        """Write the motion in the format that the ending says: .npz .bvh .trc .c3d .glb .csv .mot.

        All numbers are kept by .npz only. The file appears when it is whole, and replaces one that is there.

        Raises:
            InputError: another ending, or a file that cannot be written.
        """
        export_motion(self, Path(path))

    def of_rows(self, rows: slice | Int[np.ndarray, "_row"] | Bool[np.ndarray, "_frame"]) -> "Motion":
        """The motion in some of its frames."""
        known = {name: getattr(self, name) for name in per_frame_fields()}
        return replace(self, **{name: values[rows] for name, values in known.items() if values is not None})


def motion_from_poses(
    body: Body,
    poses: Float[np.ndarray | Array, "frame dof"],
    fps: float,
    *,
    frame: Int[np.ndarray, "frame"] | None = None,
    similarity: Float[np.ndarray, "frame"] | None = None,
    energy: Float[np.ndarray, "frame"] | None = None,
    iterations: Int[np.ndarray, "frame"] | None = None,
    converged: Bool[np.ndarray, "frame"] | None = None,
    up: str = DEFAULT_UP,
    limb_names: Sequence[str] | None = None,
    joint_limb: Int[np.ndarray, "joint"] | None = None,
    limb_doubt: Float[np.ndarray, "frame limb"] | None = None,
    limb_unlike: Float[np.ndarray, "frame limb"] | None = None,
    limb_rival: Float[np.ndarray, "frame limb"] | None = None,
    limb_hidden: Float[np.ndarray, "frame limb"] | None = None,
    explained: Float[np.ndarray, "frame"] | None = None,
    overlap: Float[np.ndarray, "frame camera"] | None = None,
    camera_names: Sequence[str] | None = None,
    unfiltered_pose: Float[np.ndarray, "frame dof"] | None = None,
) -> Motion:
    """The motion of `body`, which stands upright in a world with the vertical `up`, through `poses`.

    `frame` counts from 0 where it is not given; without a solver's account `similarity` and `energy` are NaN,
    `iterations` 0 and `converged` true.
    """
    skeleton = body.skeleton
    poses = np.asarray(poses, skeleton.offsets.dtype)
    count = poses.shape[0]
    frame = np.arange(count) if frame is None else frame
    joint_params, world_from_joint, blob_means = _forward_in_blocks(body, poses)
    unknown = np.full(count, np.nan)
    return Motion(
        fps=float(fps),
        frame=frame,
        time=frame / float(fps),
        pose=poses,
        dof_names=np.array(skeleton.dof_names, str),
        joint_params=joint_params,
        joint_param_names=np.array(skeleton.names, str),
        joint_names=np.array(skeleton.names, str),
        joint_parents=np.array(skeleton.parents, int),
        world_from_joint=world_from_joint,
        blob_means=blob_means,
        blob_joint=np.array(body.blobs.joints, int),
        blob_sigma=np.asarray(body.blob_sigmas),
        similarity=unknown if similarity is None else similarity,
        energy=unknown if energy is None else energy,
        iterations=np.zeros(count, int) if iterations is None else iterations,
        converged=np.ones(count, bool) if converged is None else converged,
        up=up,
        actor=body.name,
        limb_names=None if limb_names is None else np.array(limb_names, str),
        joint_limb=joint_limb,
        limb_doubt=limb_doubt,
        limb_unlike=limb_unlike,
        limb_rival=limb_rival,
        limb_hidden=limb_hidden,
        explained=explained,
        overlap=overlap,
        camera_names=None if camera_names is None else np.array(camera_names, str),
        unfiltered_pose=unfiltered_pose,
        landmark_names=np.array(body.landmarks.names, str),
        landmark_joint=np.array(body.landmarks.joints, int),
        landmark_offset=np.asarray(body.landmarks.offsets),
    )


def load_motion(path: Path) -> Motion:
    """Read `motion.npz`, or the folder of a run that wrote one.

    Raises:
        InputError: no such file, no npz, another version, or an array missing, misshapen or not finite.
    """
    path = path / "motion.npz" if (path / "motion.npz").is_file() else path
    return checked_motion(path, read_npz(path))


def checked_motion(path: Path, arrays: dict[str, np.ndarray]) -> Motion:
    """The motion that the arrays of a file are.

    Raises:
        InputError: another version, or an array missing, misshapen or not finite.
    """
    version = number(path, arrays, "format_version")
    if version != FORMAT_VERSION:
        raise InputError(f"{path}: has the format version {version:g}, not {FORMAT_VERSION}; track again")
    fps = number(path, arrays, "fps")
    if not 0 < fps < np.inf:
        raise InputError(f"{path}: 'fps' is {fps}, not positive; correct it")
    frame = int_array(path, arrays, "frame", (None,))
    dof_names = text_array(path, arrays, "dof_names", (None,))
    param_names = text_array(path, arrays, "joint_param_names", (None,))
    joint_names = text_array(path, arrays, "joint_names", (None,))
    blob_sigma = finite_array(path, arrays, "blob_sigma", (None,))
    frames, joints, blobs = len(frame), len(joint_names), len(blob_sigma)
    motion = Motion(
        fps=fps,
        frame=frame,
        time=finite_array(path, arrays, "time", (frames,)),
        pose=finite_array(path, arrays, "pose", (frames, len(dof_names))),
        dof_names=dof_names,
        joint_params=finite_array(path, arrays, "joint_params", (frames, len(param_names))),
        joint_param_names=param_names,
        joint_names=joint_names,
        joint_parents=int_array(path, arrays, "joint_parents", (joints,)),
        world_from_joint=finite_array(path, arrays, "world_from_joint", (frames, joints, 4, 4)),
        blob_means=finite_array(path, arrays, "blob_means", (frames, blobs, 3)),
        blob_joint=int_array(path, arrays, "blob_joint", (blobs,)),
        blob_sigma=blob_sigma,
        similarity=float_array(path, arrays, "similarity", (frames,)),
        energy=float_array(path, arrays, "energy", (frames,)),
        iterations=int_array(path, arrays, "iterations", (frames,)),
        converged=bool_array(path, arrays, "converged", (frames,)),
        up=str(text_array(path, arrays, "up", ())) if "up" in arrays else DEFAULT_UP,
        actor=str(text_array(path, arrays, "actor", ())) if "actor" in arrays else "",
        **_limbs(path, arrays, frames, joints),
        **_fit(path, arrays, frames),
        **_filtered(path, arrays, (frames, len(dof_names))),
        **_landmarks(path, arrays),
    )
    _check(path, motion)
    return motion


def _limbs(path: Path, arrays: dict[str, np.ndarray], frames: int, joints: int) -> dict[str, Any]:
    """What was judged of the limbs, which a file need not have."""
    if "limb_doubt" not in arrays:
        return {}
    names = text_array(path, arrays, "limb_names", (None,))
    found = {
        "limb_names": names,
        "joint_limb": int_array(path, arrays, "joint_limb", (joints,)),
        "limb_doubt": finite_array(path, arrays, "limb_doubt", (frames, len(names))),
    }
    for name in ("limb_unlike", "limb_hidden"):
        if name in arrays:
            found[name] = finite_array(path, arrays, name, (frames, len(names)))
    if "limb_rival" in arrays:  # NaN where none was searched
        found["limb_rival"] = float_array(path, arrays, "limb_rival", (frames, len(names)))
    wrong = (found["joint_limb"] < -1) | (found["joint_limb"] >= len(names))
    if wrong.any():
        raise InputError(f"{path}: 'joint_limb' holds {found['joint_limb'][wrong][0]}, which is not a limb; correct it")
    return found


def _fit(path: Path, arrays: dict[str, np.ndarray], frames: int) -> dict[str, Any]:
    """How well the body lies on what is seen, which a file need not say."""
    if "explained" not in arrays or "overlap" not in arrays:
        return {}
    names = text_array(path, arrays, "camera_names", (None,))
    return {
        "explained": finite_array(path, arrays, "explained", (frames,)),
        "overlap": float_array(path, arrays, "overlap", (frames, len(names))),
        "camera_names": names,
    }


def _filtered(path: Path, arrays: dict[str, np.ndarray], shape: tuple[int, int]) -> dict[str, Any]:
    """What a filter made of the poses, if one did."""
    if "unfiltered_pose" not in arrays or "filtered_by" not in arrays:
        return {}
    return {
        "filtered_by": str(text_array(path, arrays, "filtered_by", ())),
        "unfiltered_pose": finite_array(path, arrays, "unfiltered_pose", shape),
    }


def _landmarks(path: Path, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    """The landmarks, which a file need not have."""
    if "landmark_names" not in arrays:
        return {}
    names = text_array(path, arrays, "landmark_names", (None,))
    return {
        "landmark_names": names,
        "landmark_joint": int_array(path, arrays, "landmark_joint", (len(names),)),
        "landmark_offset": finite_array(path, arrays, "landmark_offset", (len(names), 3)),
    }


def _forward_in_blocks(
    body: Body, poses: Float[np.ndarray, "frame dof"]
) -> tuple[Float[np.ndarray, "frame joint"], Float[np.ndarray, "frame joint 4 4"], Float[np.ndarray, "frame blob 3"]]:
    count = len(poses)
    num_blocks = max(-(-count // FRAMES_AT_ONCE), 1)
    padded = np.pad(poses, ((0, num_blocks * FRAMES_AT_ONCE - count), (0, 0)))
    blocks = [
        jax.device_get(_forward(body, jnp.asarray(padded[first : first + FRAMES_AT_ONCE])))
        for first in range(0, len(padded), FRAMES_AT_ONCE)
    ]
    joint_params, world_from_joint, blob_means = (np.concatenate(parts)[:count] for parts in zip(*blocks, strict=True))
    return joint_params, world_from_joint, blob_means


@compiled
def _forward(
    body: Body, poses: Float[Array, "frame dof"]
) -> tuple[Float[Array, "frame joint"], Float[Array, "frame joint 4 4"], Float[Array, "frame blob 3"]]:
    skeleton = body.skeleton

    def one(pose: Float[Array, "dof"]):
        world_from_joint = skeleton.world_from_joint(pose)
        return skeleton.joint_params(pose), world_from_joint, body.blobs.points_world(world_from_joint)

    return jax.vmap(one)(poses)


def _check(path: Path, motion: Motion) -> None:
    """Refuse indices that point nowhere, and anything but a sequence of rigid frames."""
    if motion.up not in UP_AXES:
        raise InputError(f"{path}: 'up' is {motion.up!r}; it should be one of {', '.join(UP_AXES)}")
    joints = np.arange(len(motion.joint_names))
    wrong = (motion.joint_parents < -1) | (motion.joint_parents >= joints)
    if wrong.any():
        joint, parent = motion.joint_names[wrong][0], motion.joint_parents[wrong][0]
        raise InputError(
            f"{path}: 'joint_parents' gives {joint!s} the parent {parent}; parents come before their children"
        )
    wrong = (motion.blob_joint < 0) | (motion.blob_joint >= len(joints))
    if wrong.any():
        raise InputError(f"{path}: 'blob_joint' holds {motion.blob_joint[wrong][0]}, which is not a joint; correct it")
    landmark_joint = np.zeros(0, int) if motion.landmark_joint is None else motion.landmark_joint
    wrong = (landmark_joint < 0) | (landmark_joint >= len(joints))
    if wrong.any():
        raise InputError(f"{path}: 'landmark_joint' holds {landmark_joint[wrong][0]}, which is not a joint; correct it")
    if (np.diff(motion.frame) <= 0).any():
        raise InputError(f"{path}: 'frame' does not increase ({motion.frame[:5].tolist()} ...); sort the frames")
    for key in ("similarity", "energy"):
        if np.isinf(getattr(motion, key)).any():
            raise InputError(f"{path}: {key!r} is infinite somewhere; write NaN where it is not known")
    rotation = motion.world_from_joint[..., :3, :3]
    with np.errstate(over="ignore", invalid="ignore"):  # of numbers that are no rotations at all
        deviation = np.abs(rotation @ np.swapaxes(rotation, -1, -2) - np.eye(3)).max(initial=0.0)
    if not deviation <= 1e-3:
        raise InputError(
            f"{path}: 'world_from_joint' holds no rotations (they are off by {deviation:.3g}); track again"
        )
