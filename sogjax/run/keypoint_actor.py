"""Actors from keypoints that other programs left beside a recording: no T-pose, and no search for its pose."""

from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.actor.colors import measured_colors
from sogjax.errors import counted
from sogjax.io.keypoints.load import Keypoints, load_keypoints
from sogjax.io.keypoints.scheme import KeypointScheme
from sogjax.io.pose_description import PoseDescription
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.rotation import world_from_upright
from sogjax.model.shape import ShapeModel
from sogjax.run.recordings import upright
from sogjax.run.terminal import say
from sogjax.search.keypoint_people import triangulated_people
from sogjax.search.keypoint_pose import KeypointPose, pose_of_keypoints, shape_of_keypoints

LOOKED_AT = 120
"""Frames spread over the clip in which bones are measured."""
POSED, FEWEST = 12, 3
"""Frames from which colours are taken, at most and at least."""
LEAST_ON, LEAST_POINTS = 0.8, 10
"""Share of the points that a pose must be on, and how many there must be."""


@dataclass(frozen=True)
class SeenPoints:
    """Triangulated keypoints of one person in some frames."""

    scheme: KeypointScheme
    frames: tuple[int, ...]
    """The recording's numbers."""
    points: Float[np.ndarray, "frame keypoint 3"]
    """Metres; NaN where unknown."""

    def pose(self, body: Body, up: str, row: int) -> KeypointPose | None:
        """The pose of a body, upright in the recording's world, if most of the points agree with it."""
        found = pose_of_keypoints(body, up, self.scheme, self.points[row])
        good = found is not None and found.on >= LEAST_ON and found.num_points >= LEAST_POINTS
        return found if good else None


def seen_points(recording: Recording, frames: tuple[int, ...] | None = None) -> SeenPoints | None:
    """The triangulated points of the person in some frames, or in frames spread over the clip; None without keypoints.

    Raises:
        InputError: none of the keypoint files can be used.
    """
    keypoints = load_keypoints(recording) if len(recording.rig) > 1 else None
    if keypoints is None:
        return None
    if frames is None:
        spread = np.linspace(0, recording.num_frames - 1, min(LOOKED_AT, recording.num_frames))
        frames = tuple(recording.frames[row] for row in np.unique(spread.astype(int)).tolist())
    rows = np.array(frames, int) - recording.first_frame
    chosen = Keypoints(keypoints.scheme, keypoints.cameras, keypoints.points[:, rows])
    points = triangulated_people(chosen, recording.rig).points[:, 0]
    return SeenPoints(keypoints.scheme, frames, np.asarray(points, float))


def with_rough_poses(recording: Recording, body: Body) -> Recording:
    """The recording whose example poses that are frames of the videos have rough poses, as far as keypoints tell.

    Where the recording shows several people or has no keypoints, it stays as it is.

    Raises:
        InputError: none of the keypoint files can be used.
    """
    examples = recording.example_poses
    frames = tuple(example.frame for example in examples if example.frame is not None and example.initial_pose is None)
    seen = seen_points(recording, frames) if frames and len({example.actor for example in examples}) == 1 else None
    if seen is None:
        return recording
    placed = upright(body, recording)
    poses = {frame: seen.pose(placed, recording.up, row) for row, frame in enumerate(seen.frames)}
    told = {frame: _rough(placed, pose) for frame, pose in poses.items() if pose is not None}
    say(f"rough poses of {len(told)} of {counted(len(frames), 'example pose')} from keypoints")
    hinted = (replace(e, initial_pose=told.get(e.frame, e.initial_pose) if e.frame is not None else e.initial_pose)
              for e in examples)  # fmt: skip
    return replace(recording, example_poses=tuple(hinted))


def keypoint_actor(recording: Recording, body: Body, space: str, symmetric: bool = True) -> Body | None:
    """A body with the lengths of a person's keypoints and the colours of the pictures at the posed body.

    In its own upright frame. None where there are no keypoints, or too few frames in which most of them agree.

    Args:
        recording: of one person.
        body: to start from, in its own frame.
        space: in which colours are averaged.
        symmetric: left and right limbs have the same lengths and sizes.

    Raises:
        InputError: none of the keypoint files can be used, or a picture cannot be read.
    """
    seen = seen_points(recording)
    if seen is None:
        return None
    model = ShapeModel.from_body(upright(body, recording), symmetric)
    params = shape_of_keypoints(model, seen.scheme, seen.points)
    if params is None:
        return None
    shaped = model.shaped(jnp.asarray(params, body.blob_sigmas.dtype))
    rows = np.unique(np.linspace(0, len(seen.frames) - 1, min(POSED, len(seen.frames))).astype(int)).tolist()
    poses = {seen.frames[row]: seen.pose(shaped, recording.up, row) for row in rows}
    good = {frame: pose.pose for frame, pose in poses.items() if pose is not None}
    if len(good) < FEWEST:
        return None
    say(f"actor: lengths from the keypoints of {counted(len(seen.frames), 'frame')}, colours from {len(good)} of them")
    colored = measured_colors(recording, shaped, [*good], np.stack([*good.values()]), space)
    return colored.rotated(jnp.asarray(world_from_upright(recording.up).T, body.blob_sigmas.dtype))


def _rough(body: Body, found: KeypointPose) -> PoseDescription:
    """The pose as places of the body's landmarks."""
    points = np.asarray(body.posed_landmarks(jnp.asarray(found.pose, body.landmarks.offsets.dtype)), float)
    places = zip(body.landmarks.names, points.tolist(), strict=True)
    return PoseDescription(landmarks={name: (x, y, z) for name, (x, y, z) in places})
