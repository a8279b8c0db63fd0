"""Motion: what tracking finds, one pose per frame and all that follows from it."""

import difflib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, Shaped

from sogjax.errors import InputError, counted
from sogjax.io.array_log import read_log
from sogjax.io.files import atomic_path
from sogjax.io.npz_file import bool_array, finite_array, float_array, int_array, number, read_npz, text_array
from sogjax.model.body import Body
from sogjax.model.rotation import UP_AXES

FORMAT_VERSION = 1
DEFAULT_UP = "z"
"""The vertical of a file that does not give one."""
FRAMES_AT_ONCE = 8
"""Joint frames and blobs are computed in blocks of so many frames, so that one program serves motions of any length."""


@dataclass(repr=False)
class Motion:
    """The motion of one actor: poses, joints and blobs by frame; metres, radians, seconds, world frame."""

    fps: float
    frame: Int[np.ndarray, "frame"]
    """Frames of the recording, increasing."""
    time: Float[np.ndarray, "frame"]
    """Seconds since frame 0 of the recording."""
    pose: Float[np.ndarray, "frame dof"]
    dof_names: Shaped[np.ndarray, "dof"]
    joint_params: Float[np.ndarray, "frame joint_param"]
    joint_param_names: Shaped[np.ndarray, "joint_param"]
    joint_names: Shaped[np.ndarray, "joint"]
    joint_parents: Int[np.ndarray, "joint"]
    """-1 for a root; parents come before their children."""
    world_from_joint: Float[np.ndarray, "frame joint 4 4"]
    blob_means: Float[np.ndarray, "frame blob 3"]
    blob_joint: Int[np.ndarray, "blob"]
    blob_sigma: Float[np.ndarray, "blob"]
    similarity: Float[np.ndarray, "frame"]
    """NaN where it was not computed, as in `energy`."""
    energy: Float[np.ndarray, "frame"]
    iterations: Int[np.ndarray, "frame"]
    converged: Bool[np.ndarray, "frame"]
    up: str = DEFAULT_UP
    """The world's vertical, one of `sogjax.model.rotation.UP_AXES`."""
    actor: str = ""
    """Whose motion it is; empty if the file does not say."""
    limb_names: Shaped[np.ndarray, "limb"] | None = None
    """None where limbs were not judged, as in the other two."""
    joint_limb: Int[np.ndarray, "joint"] | None = None
    """The limb that each joint belongs to; -1 for the trunk's."""
    limb_doubt: Float[np.ndarray, "frame limb"] | None = None
    """How likely each limb is more than 10 cm off, 0 to 1."""
    explained: Float[np.ndarray, "frame"] | None = None
    """Part of the actor's visible area that shows its own colours and no background; None where it was not judged."""
    overlap: Float[np.ndarray, "frame camera"] | None = None
    """Of its silhouette with the foreground around it (intersection over union); NaN where no background is known."""
    camera_names: Shaped[np.ndarray, "camera"] | None = None
    """Of the columns of `overlap`."""

    landmark_names: Shaped[np.ndarray, "landmark"] | None = None
    """Of points fixed to joints; None where the file does not have them, as in the other two."""
    landmark_joint: Int[np.ndarray, "landmark"] | None = None
    landmark_offset: Float[np.ndarray, "landmark 3"] | None = None
    """In the frame of the landmark's joint."""

    def __repr__(self) -> str:
        whose = f" of {self.actor}" if self.actor else ""
        frames = f"{counted(self.num_frames, 'frame')} at {self.fps:g} Hz"
        return f"<Motion{whose}: {frames}, {counted(len(self.joint_names), 'joint')}>"

    @property
    def num_frames(self) -> int:
        """Number of frames."""
        return len(self.frame)

    def joint(self, name: str) -> Float[np.ndarray, "frame 3"]:
        """Where a joint or landmark is in every frame, in metres in the world.

        Raises:
            InputError: the motion has no point of this name.
        """
        landmarks = [] if self.landmark_names is None else self.landmark_names.tolist()
        if name in landmarks and self.landmark_joint is not None and self.landmark_offset is not None:
            k = landmarks.index(name)
            frames = self.world_from_joint[:, self.landmark_joint[k]]
            return frames[:, :3, :3] @ self.landmark_offset[k] + frames[:, :3, 3]
        joints = self.joint_names.tolist()
        if name in joints:
            return self.world_from_joint[:, joints.index(name), :3, 3]
        known = [*landmarks, *joints]
        near = difflib.get_close_matches(name, known, 1)
        hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known)}"
        raise InputError(f"the motion has no joint or landmark {name!r}; {hint}")

    def save(self, path: str | Path) -> None:
        """Write the motion in the format that the ending says: .npz .bvh .trc .c3d .glb .csv .mot.

        All numbers are kept by .npz only. The file appears when it is whole, and replaces one that is there.

        Raises:
            InputError: another ending, or a file that cannot be written.
        """
        # The writers know what a motion is: they cannot be imported before it.
        import_module("sogjax.io.export.write").export_motion(self, Path(path))


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
    explained: Float[np.ndarray, "frame"] | None = None,
    overlap: Float[np.ndarray, "frame camera"] | None = None,
    camera_names: Sequence[str] | None = None,
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
        explained=explained,
        overlap=overlap,
        camera_names=None if camera_names is None else np.array(camera_names, str),
        landmark_names=np.array(body.landmarks.names, str),
        landmark_joint=np.array(body.landmarks.joints, int),
        landmark_offset=np.asarray(body.landmarks.offsets),
    )


def save_motion(path: Path, motion: Motion) -> None:
    """Write `motion.npz`: the fields, and where the landmarks are, by plain names."""
    arrays = arrays_of(motion)
    if motion.landmark_names is not None and len(motion.landmark_names):
        names = motion.landmark_names.tolist()
        arrays["points"] = np.stack([motion.joint(name) for name in names], axis=1).astype(np.float32)
        arrays["point_names"] = np.array(names, str)
    arrays["format_version"] = np.array(FORMAT_VERSION)
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)  # pyright: ignore[reportArgumentType]


def arrays_of(motion: Motion) -> dict[str, np.ndarray]:
    """The fields of a motion by name, without those that it does not have."""
    values = {entry.name: getattr(motion, entry.name) for entry in fields(motion)}
    return {name: np.asarray(value) for name, value in values.items() if value is not None}


def load_motion(path: Path) -> Motion:
    """Read `motion.npz`, the folder of a run that wrote one, or that of a motion being written (`MotionLog`).

    Raises:
        InputError: no such file, no npz, another version, or an array missing, misshapen or not finite.
    """
    path = path / "motion.npz" if (path / "motion.npz").is_file() else path
    return checked_motion(path, read_log(path) if path.is_dir() else read_npz(path))


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


@eqx.filter_jit
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
