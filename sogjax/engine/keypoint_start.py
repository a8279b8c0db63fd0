"""The first pose from keypoints that another program left beside a recording: nothing has to be searched."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.data.keypoints import load_keypoints
from sogjax.data.recording import Recording
from sogjax.engine.terminal import say
from sogjax.model.body import Body
from sogjax.tracking.keypoint_people import triangulated_people
from sogjax.tracking.keypoint_pose import KeypointPose, pose_of_keypoints

LEAST_ON = 0.7
"""Share of the points that the body's landmarks must be on."""
LEAST_POINTS = 10
"""Points that a pose must be fitted to."""


def keypoint_start(recording: Recording, body: Body, frame: int) -> Float[Array, "dof"] | None:
    """The pose of a body, upright in the recording's world, in a frame counted from the recording's first.

    None where the recording has no keypoints, or they give no pose that most of them agree with.

    Raises:
        InputError: none of the keypoint files can be used.
    """
    found = keypoint_pose(recording, body, frame)
    if found is None:
        return None
    shown = frame + recording.first_frame
    good = found.on >= LEAST_ON and found.num_points >= LEAST_POINTS
    what = f"{found.num_points} keypoints, {100.0 * found.on:.0f} % of them on the body"
    say(f"pose of {body.name} in frame {shown} from {what}{'' if good else ': not sure, so it is searched for'}")
    return jnp.asarray(found.pose, body.poses["rest"].dtype) if good else None


def keypoint_pose(recording: Recording, body: Body, frame: int) -> KeypointPose | None:
    """The pose that fits the triangulated keypoints of a frame best; None where too few are known."""
    only = replace(recording, first_frame=recording.first_frame + frame, num_frames=1)
    keypoints = load_keypoints(only)
    if keypoints is None or len(recording.rig) < 2:
        return None
    for warning in keypoints.warnings:
        say(f"warning: {warning}")
    points = triangulated_people(keypoints, recording.rig).points[0, 0]
    return pose_of_keypoints(body, recording.up, keypoints.scheme, np.asarray(points, float))
