"""How differently cameras show the same colours, from the blobs of an actor that several of them see."""

from collections.abc import Mapping, Sequence

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from sogjax.actor.colors import ColoredView, blob_samples
from sogjax.model.body import Body
from sogjax.model.color import linear_light

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
    parts = [blob_samples(body, view) for view in views]
    samples = [np.concatenate(of_blob) for of_blob in zip(*parts, strict=True)]
    middle = np.stack([np.median(rgb, axis=0) if len(rgb) >= FEWEST_SAMPLES else np.full(3, np.nan) for rgb in samples])
    light = np.asarray(linear_light(jnp.asarray(middle, jnp.float32)), float)
    return np.log(np.where((light >= DARKEST) & (light <= BRIGHTEST), light, np.nan))


def _median(values: Float[np.ndarray, "camera blob 3"], axis: int) -> Float[np.ndarray, "_ 3"]:
    """Median of the known values; NaN where there are none."""
    known = np.isfinite(values).any(axis=axis)
    filled = np.where(np.expand_dims(known, axis), values, 0.0)
    return np.where(known, np.nanmedian(filled, axis=axis), np.nan)
