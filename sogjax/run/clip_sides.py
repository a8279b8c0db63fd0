"""Whether limbs show the colours of their counterparts where they were tracked: what is lost lies on something else.

A limb that was not found in the frames that an actor is made of may be found while tracking, or the other way round.
"""

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.actor.colors import ColoredView, Samples, all_samples, colors_of, joined_samples
from sogjax.actor.limb_colors import limb_pairs_alike
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.video import read_chosen
from sogjax.model.body import Body
from sogjax.model.camera import camera_of
from sogjax.model.limbs import limb_names

NUM_LOOKED_AT = 10
"""Frames, spread over the motion."""
UNLIKE = 0.045
"""Mean distance of the blobs' colours (sRGB, 0 to 1), equally bright, from which on one of a pair is lost.
`experiments/clip_sides.py`: 14 of 22 pairs of arms of which one was lost are beyond, and none of 45 others."""


def colors_by_frame(recording: Recording, actors: Mapping[str, tuple[Body, Motion]]) -> dict[str, dict[int, Samples]]:
    """What some frames, by their numbers, show of every blob of each actor, by the actors' names.

    Args:
        recording: that is read.
        actors: bodies, upright in the recording's world, and their motions.

    Raises:
        InputError: a video cannot be read.
    """
    frames = next(iter(actors.values()))[1].frame
    rows = np.unique(np.linspace(0, len(frames) - 1, NUM_LOOKED_AT).astype(int)).tolist()
    numbers = {row: int(frames[row]) for row in rows}
    shown = dict(read_chosen(recording, [*numbers.values()]))

    def views(motion: Motion, row: int) -> list[ColoredView]:
        pose = jnp.asarray(motion.pose[row], jnp.float32)
        images = enumerate(shown[numbers[row]])
        return [ColoredView(camera_of(recording.rig.cameras, k), i, None, pose) for k, i in images if i is not None]

    return {
        name: {number: all_samples(body, views(motion, row)) for row, number in numbers.items()}
        for name, (body, motion) in actors.items()
    }


def colors_apart(
    recording: Recording, actors: Mapping[str, tuple[Body, Motion]], color_space: str
) -> dict[str, dict[str, float]]:
    """How far the colours of each pair of limbs are apart in a motion, equally bright, by their names, of each actor.

    A light from one side made one arm of a real man half as bright again as the other.

    Args:
        recording: that is read.
        actors: bodies, upright in the recording's world, and their motions.
        color_space: in which colours are averaged.

    Raises:
        InputError: a video cannot be read.
    """
    found: dict[str, dict[str, float]] = {}
    for name, by_frame in colors_by_frame(recording, actors).items():
        body = actors[name][0]
        samples, names = joined_samples([*by_frame.values()]), limb_names(body)
        colors = colors_of(body, samples, color_space).colors
        found[name] = {
            " or ".join(names[k] for k in pair.limbs): _apart(*(colors[blobs] for blobs in pair.blobs))
            for pair in limb_pairs_alike(body)
        }
    return found


def _apart(one: Float[np.ndarray, "blob 3"], other: Float[np.ndarray, "blob 3"]) -> float:
    """The mean distance of colours, each pair as bright as its mean."""
    brightness = [np.maximum(colors.sum(axis=1, keepdims=True), 1e-3) for colors in (one, other)]
    mean = 0.5 * (brightness[0] + brightness[1])
    return float(np.linalg.norm(mean * (one / brightness[0] - other / brightness[1]), axis=1).mean())


def unlike_where_tracked(apart: Mapping[str, float]) -> str | None:
    """Of which pairs of limbs, by how far their colours are apart, one is lost; None: of none."""
    said = [f"{names} ({distance:.3f} apart)" for names, distance in apart.items() if distance > UNLIKE]
    if not said:
        return None
    return (
        f"look at the {', and the '.join(said)}: where they were tracked, left and right show other colours "
        f"({UNLIKE:g} and less is usual), so one is lost, unless clothes differ; name frames with clear limbs in "
        "recording.yaml, such as `example_poses: [0, 150]`"
    )
