"""Colours of the blobs: the example pictures projected back onto the body, hidden views left out (Section 5.2).

How differently cameras show the same colours, from the blobs of an actor that several of them see.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.io.recording import Recording
from sogjax.io.video import read_chosen
from sogjax.model.body import Body
from sogjax.model.camera import Camera, camera_of, distort, project, project_points
from sogjax.model.color import averaging_space, from_rgb, linear_light, to_rgb
from sogjax.model.compiled import compiled_hastily
from sogjax.model.program import compiled
from sogjax.model.sog import Sog
from sogjax.search.placed_body import means_of

SAMPLE_RADIUS = 0.8
"""Samples are taken within this many sigmas of a blob's centre."""
HIDING_RADIUS = 1.0
"""A blob hides what lies behind it within this many sigmas of its centre."""
MIN_SAMPLES = 12

_RINGS = ((0.0, 1), (0.5, 6), (1.0, 10))
"""Radius (in `SAMPLE_RADIUS`) and number of samples of each ring of the sampling pattern."""


@dataclass(frozen=True)
class ColoredView:
    """One picture of the subject in a known pose."""

    camera: Camera
    image: UInt8[np.ndarray, "height width 3"]
    """BGR."""
    mask: Bool[np.ndarray, "height width"] | None
    """The subject, where it is known."""
    pose: Float[Array, "dof"]


class BlobColors(NamedTuple):
    """What pictures show of every blob."""

    colors: Float[np.ndarray, "blob 3"]
    """Robust mean (sRGB, 0..1); a blob that no picture shows takes the colour of the nearest blob that is shown."""
    shown: Bool[np.ndarray, "blob"]


Samples = list[Float[np.ndarray, "_n 3"]]
"""Colours (RGB, 0..1) that pictures show of every blob."""


def back_projected_colors(body: Body, views: Sequence[ColoredView], color_space: str) -> BlobColors:
    """The colours of every blob, averaged in a colour space."""
    return colors_of(body, all_samples(body, views), color_space)


def all_samples(body: Body, views: Sequence[ColoredView]) -> Samples:
    """What some pictures together show of every blob."""
    return joined_samples([blob_samples(body, view) for view in views])


def joined_samples(parts: Sequence[Samples]) -> Samples:
    """All samples of every blob."""
    return [np.concatenate(of_blob) for of_blob in zip(*parts, strict=True)]


def colors_of(body: Body, samples: Samples, color_space: str) -> BlobColors:
    """The colours of every blob, the mean of its samples in a colour space."""
    space = averaging_space(color_space)
    converted = np.asarray(_from_rgb(jnp.asarray(np.concatenate(samples), jnp.float32), space))
    parts = np.split(converted, np.cumsum([len(part) for part in samples])[:-1])
    shown = np.array([len(part) >= MIN_SAMPLES for part in parts])
    means = np.stack([_robust_mean(part) if enough else np.zeros(3) for part, enough in zip(parts, shown, strict=True)])
    return BlobColors(_filled(body, np.asarray(_to_rgb(jnp.asarray(means, jnp.float32), space), float), shown), shown)


def blob_samples(body: Body, view: ColoredView) -> Samples:
    """Colours (RGB, 0..1) that one picture shows of every blob; none where the blob is hidden."""
    pixels, visible = _sample_pixels(body, view)
    height, width = view.image.shape[:2]
    column, row = (np.rint(pixels[..., k]).astype(int) for k in (0, 1))
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & visible
    column, row = np.where(inside, column, 0), np.where(inside, row, 0)
    if view.mask is not None:
        inside &= view.mask[row, column]
    rgb = view.image[row, column][..., ::-1] / 255.0
    return [rgb[blob][inside[blob]] for blob in range(body.num_blobs)]


def _sample_pixels(
    body: Body, view: ColoredView
) -> tuple[Float[np.ndarray, "blob sample 2"], Bool[np.ndarray, "blob sample"]]:
    """Where the sampling pattern of every blob lies in the picture as recorded, and which samples are not hidden."""
    seen, depths = _seen_blobs(body, view.camera, view.pose)
    depth = np.asarray(depths, float)
    centre, sigma = np.asarray(seen.means, float), np.asarray(seen.sigmas, float)
    pattern = np.concatenate(
        [
            radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            for radius, count in _RINGS
            for angle in [np.arange(count) * 2.0 * np.pi / count]
        ]
    )
    pixels = centre[:, None] + SAMPLE_RADIUS * sigma[:, None, None] * pattern[None]
    distance = np.linalg.norm(pixels[:, :, None] - centre[None, None], axis=-1)
    nearer = depth[None, :] < (depth - np.asarray(body.blob_sigmas, float))[:, None]
    hidden = np.any((distance < HIDING_RADIUS * sigma) & nearer[:, None, :], axis=-1)
    recorded = np.asarray(_distorted(view.camera, jnp.asarray(pixels.reshape(-1, 2), seen.means.dtype)))
    return recorded.reshape(pixels.shape), ~hidden & np.asarray(seen.mask)[:, None]


@compiled
def _seen_blobs(body: Body, camera: Camera, pose: Float[Array, "dof"]) -> tuple[Sog, Float[Array, "blob"]]:
    """The projected blobs and their depths (metres)."""
    blobs = body.posed_blobs(pose)
    return project(camera, blobs), project_points(camera, blobs.means)[1]


_distorted = compiled(distort)
_from_rgb, _to_rgb = compiled_hastily(from_rgb), compiled_hastily(to_rgb)


def _robust_mean(colors: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "3"]:
    """Mean of the half of the samples that lie nearest to their median."""
    distance = np.linalg.norm(colors - np.median(colors, axis=0), axis=1)
    return colors[distance <= np.median(distance)].mean(axis=0)


def _filled(
    body: Body, colors: Float[np.ndarray, "blob 3"], seen: Bool[np.ndarray, "blob"]
) -> Float[np.ndarray, "blob 3"]:
    """Colours of blobs that were never seen, from the nearest blob that was; the body's own where none was."""
    if not seen.any():
        return np.asarray(body.blob_colors, float)
    means = means_of(body, np.asarray(body.poses["rest"])[None])[0].astype(float)
    distance = np.linalg.norm(means[:, None] - means[None, seen], axis=-1)
    return colors[seen][np.argmin(distance, axis=1)]


def colored(body: Body, colors: Float[np.ndarray, "blob 3"]) -> Body:
    """The body with other blob colours (sRGB, 0..1)."""
    return eqx.tree_at(lambda b: b.blob_colors, body, jnp.asarray(colors, body.blob_colors.dtype))


FEWEST_SAMPLES = 8
DARKEST, BRIGHTEST = 0.01, 0.95
"""Linear light: darker samples are noise, brighter ones are cut off."""
ROUNDS = 20


def estimated_gains(body: Body, views: Mapping[int, Sequence[ColoredView]]) -> dict[int, Float[np.ndarray, "3"]]:
    """By camera the factors of red, green and blue light that make its pictures like those of the others.

    A blob looks the same to all cameras up to the camera's factors and to shading, which differs from blob to blob: so
    the logarithm of what a camera sees of a blob is that of the blob less that of the camera's gain, fitted by medians.
    The gains have the geometric mean 1. A camera that shows too little keeps 1.
    """
    cameras = list(views)
    seen = np.stack([_log_light(body, views[camera]) for camera in cameras])  # camera, blob, channel; NaN: not seen
    enough = np.isfinite(seen).any(axis=2).sum(axis=0) >= 2
    seen = seen[:, enough]
    gains = np.zeros((len(cameras), 3))
    if seen.shape[1] == 0:
        return {camera: np.ones(3) for camera in cameras}
    for _ in range(ROUNDS):
        blobs = _median(seen + gains[:, None], axis=0)
        gains = _with_unknown(_median(blobs[None] - seen, axis=1))
        gains -= gains.mean(axis=0)
    return dict(zip(cameras, np.exp(gains), strict=True))


def _with_unknown(gains: Float[np.ndarray, "camera 3"]) -> Float[np.ndarray, "camera 3"]:
    """A channel of which a camera shows too little follows its other channels; 0 where it shows nothing."""
    known = np.isfinite(gains)
    others = np.where(known, gains, 0.0).sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    return np.where(known, gains, others)


def _log_light(body: Body, views: Sequence[ColoredView]) -> Float[np.ndarray, "blob 3"]:
    """Logarithm of the middle light that a camera shows of every blob, over all poses."""
    samples = all_samples(body, views)
    middle = np.stack([np.median(rgb, axis=0) if len(rgb) >= FEWEST_SAMPLES else np.full(3, np.nan) for rgb in samples])
    light = np.asarray(linear_light(jnp.asarray(middle, jnp.float32)), float)
    return np.log(np.where((light >= DARKEST) & (light <= BRIGHTEST), light, np.nan))


def _median(values: Float[np.ndarray, "camera blob 3"], axis: int) -> Float[np.ndarray, "_ 3"]:
    """Median of the known values; NaN where there are none."""
    known = np.isfinite(values).any(axis=axis)
    filled = np.where(np.expand_dims(known, axis), values, 0.0)
    return np.where(known, np.nanmedian(filled, axis=axis), np.nan)


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
        for frame, images in read_chosen(recording, frames)
        for k, image in enumerate(images)
        if image is not None
    ]
    return colored(body, back_projected_colors(body, views, space).colors)
