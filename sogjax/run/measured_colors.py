"""The colours of a posed body, from the pictures of a few frames."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.actor.colors import ColoredView, back_projected_colors, colored
from sogjax.io.recording import Recording
from sogjax.io.video import read_frames
from sogjax.model.body import Body
from sogjax.model.camera import camera_of


def measured_colors(
    recording: Recording, body: Body, frames: list[int], poses: Float[np.ndarray, "chosen dof"], space: str
) -> Body:
    """The body with the colours that the pictures of some frames show.

    Args:
        recording: whose pictures are read.
        body: upright in the recording's world.
        frames: the recording's numbers, increasing.
        poses: in those frames.
        space: in which colours are averaged.

    Raises:
        InputError: a picture cannot be read.
    """
    rig = jax.tree.map(jnp.asarray, recording.rig.cameras)
    of_frame = dict(zip(frames, poses, strict=True))
    views = [
        ColoredView(camera_of(rig, k), image, None, jnp.asarray(of_frame[frame], jnp.float32))
        for frame, images in enumerate(read_frames(recording, frames[0], frames[-1] + 1), frames[0])
        if frame in of_frame
        for k, image in enumerate(images)
        if image is not None
    ]
    return colored(body, back_projected_colors(body, views, space))
