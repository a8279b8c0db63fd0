"""Whether limbs show the colours of their counterparts where they were tracked: what is lost lies on something else.

A limb that was not found in the frames that an actor is made of may be found while tracking, or the other way round.
"""

from collections.abc import Mapping, Sequence
from itertools import islice

import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float

from sogjax.actor.colors import ColoredView, Samples, all_samples, colors_of, joined_samples
from sogjax.actor.limb_colors import limb_pairs_alike
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.video import read_chosen
from sogjax.model.body import Body, concatenate
from sogjax.model.camera import camera_of
from sogjax.model.limbs import limb_names

Masks = Sequence[Bool[np.ndarray, "_height _width"]]
"""A mask of each camera's pictures."""
NUM_LOOKED_AT = 10
"""Frames, spread over the motion."""
UNLIKE = 0.045
"""Mean distance of the blobs' colours (sRGB, 0 to 1), equally bright, from which on one of a pair is lost.
`experiments/clip_sides.py`: 14 of 22 pairs of arms of which one was lost are beyond, and none of 45 others."""


def colors_by_frame(
    recording: Recording, actors: Mapping[str, tuple[Body, Motion]], free: Masks | None = None
) -> dict[str, dict[int, Samples]]:
    """What some frames, by their numbers, show of every blob of each actor, by the actors' names.

    Args:
        recording: that is read.
        actors: bodies, upright in the recording's world, and their motions; they hide each other.
        free: where nothing stands in front, in the pictures of each camera; None: everywhere.

    Raises:
        InputError: a video cannot be read.
    """
    bodies, motions = zip(*actors.values(), strict=True)
    frames, together = motions[0].frame, concatenate([*bodies])
    rows = np.unique(np.linspace(0, len(frames) - 1, NUM_LOOKED_AT).astype(int)).tolist()
    shown = dict(read_chosen(recording, [int(frames[row]) for row in rows]))
    found: dict[str, dict[int, Samples]] = {name: {} for name in actors}
    for row in rows:
        pose = jnp.asarray(np.concatenate([motion.pose[row] for motion in motions]), jnp.float32)
        views = [
            ColoredView(camera_of(recording.rig.cameras, k), image, None if free is None else free[k], pose)
            for k, image in enumerate(shown[int(frames[row])])
            if image is not None
        ]
        samples = iter(all_samples(together, views))
        for name, (body, _) in actors.items():
            found[name][int(frames[row])] = [*islice(samples, body.num_blobs)]
    return found


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
