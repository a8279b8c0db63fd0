"""The record of a motion, and `motion.npz`, the file that keeps all of it."""

import difflib
from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped

from sogjax.errors import InputError, counted
from sogjax.io.npz_file import save_npz

FORMAT_VERSION = 1
DEFAULT_UP = "z"
"""The vertical of a file that does not give one."""


@dataclass(repr=False)
class MotionData:
    """The motion of one actor: poses, joints and blobs by frame; metres, radians, seconds, world frame.

    What writes a file takes this record; users get a `sogjax.io.motion.Motion`, which can be saved in all formats.
    """

    fps: float
    """Of the numbers in `frame`, which are the recording's: frame / fps is a time, however few frames there are."""
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
    """The limbs that were judged; None where none were, as in the other two."""
    joint_limb: Int[np.ndarray, "joint"] | None = None
    """The limb that each joint belongs to; -1 for the trunk's."""
    limb_doubt: Float[np.ndarray, "frame limb"] | None = None
    """How likely each limb is more than 10 cm off, 0 to 1."""
    limb_unlike: Float[np.ndarray, "frame limb"] | None = None
    """The same by what is seen of the limb alone; None where that is all that is known."""
    limb_rival: Float[np.ndarray, "frame limb"] | None = None
    """What the best other way to hold each limb gains, as a part of the actor's energy, losses beyond 0.5 % cut off;
    interpolated between key frames, NaN where none was searched."""
    limb_hidden: Float[np.ndarray, "frame limb"] | None = None
    """What part of each limb things in front hide from the cameras, 0 to 1; None where nothing is known to."""
    explained: Float[np.ndarray, "frame"] | None = None
    """Part of the actor's visible area that shows its own colours and no background; None where it was not judged."""
    overlap: Float[np.ndarray, "frame camera"] | None = None
    """Overlap of the actor's silhouette with the foreground around it, intersection over union; NaN where that is not
    known."""
    camera_names: Shaped[np.ndarray, "camera"] | None = None
    """The cameras of the columns of `overlap`."""
    filtered_by: str = ""
    """The filter that `pose`, joints and blobs went through; empty: none."""
    unfiltered_pose: Float[np.ndarray, "frame dof"] | None = None
    """What `pose` was before; None where it was not filtered."""
    landmark_names: Shaped[np.ndarray, "landmark"] | None = None
    """Points fixed to joints; None where the file does not have them, as in the other two."""
    landmark_joint: Int[np.ndarray, "landmark"] | None = None
    landmark_offset: Float[np.ndarray, "landmark 3"] | None = None
    """Where each landmark is in the frame of its joint."""

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


@cache
def per_frame_fields() -> tuple[str, ...]:
    """The fields of a motion that have a row for each frame, as their shapes say."""
    shapes = lambda kind: [getattr(each, "dim_str", "") for each in (kind, *get_args(kind))]
    hints = get_type_hints(MotionData)
    return tuple(name for name, kind in hints.items() if any(shape.startswith("frame") for shape in shapes(kind)))


def save_motion(path: Path, motion: MotionData) -> None:
    """Write `motion.npz`: the fields, and where the landmarks are, by plain names."""
    arrays = arrays_of(motion)
    if motion.landmark_names is not None and len(motion.landmark_names):
        names = motion.landmark_names.tolist()
        arrays["points"] = np.stack([motion.joint(name) for name in names], axis=1).astype(np.float32)
        arrays["point_names"] = np.array(names, str)
    save_npz(path, arrays | {"format_version": np.array(FORMAT_VERSION)})


def arrays_of(motion: MotionData) -> dict[str, np.ndarray]:
    """The fields of a motion by name, without those that it does not have."""
    values = {entry.name: getattr(motion, entry.name) for entry in fields(motion)}
    return {name: np.asarray(value) for name, value in values.items() if value is not None}
