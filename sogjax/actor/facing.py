"""Front or back: what the silhouettes of one picture set hardly tell, several of them and their colours together do."""

from collections.abc import Sequence
from itertools import product

import equinox as eqx
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.colors import ColoredView, blob_samples
from sogjax.model.body import Body
from sogjax.model.frames import world_from_upright

SIDES = 4
"""Sides of the body that are told apart: front, left, back and right."""
FEWEST_SAMPLES = 6
"""Of a blob in one picture, to say what colour it has on that side."""

COLOR_WEIGHT = 2.0
"""Of the squared deviation of colours, against a share of the fit. Somebody seen back to front in one of five moments
loses 0.3 % of the fit, and colours then deviate by 0.0015 more."""

SideColors = Float[np.ndarray, "blob side 3"]
"""Colours (sRGB, 0..1) of every blob on every side; NaN where it is not seen."""


def side_colors(body: Body, views: Sequence[ColoredView], up: str) -> SideColors:
    """What the pictures of one moment show of every side of every blob."""
    sums, counts = np.zeros((body.num_blobs, SIDES, 3)), np.zeros((body.num_blobs, SIDES, 1))
    for view in views:
        sides = _sides(body, view, up)
        for blob, samples in enumerate(blob_samples(body, view)):
            if len(samples) >= FEWEST_SAMPLES:
                sums[blob, sides[blob]] += np.median(samples, axis=0)
                counts[blob, sides[blob]] += 1
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def _sides(body: Body, view: ColoredView, up: str) -> np.ndarray:
    """Which side of each blob a camera sees."""
    pose, rest = view.pose, body.poses["rest"]
    frames, means = zip(*(map(np.asarray, _frames_and_means(body, p)) for p in (pose, rest)), strict=True)
    turns = [frame[:, :3, :3].astype(float) for frame in frames]
    of_joint = np.einsum("jab,jcb->jac", turns[1], turns[0])  # from the pose to the rest pose, by joint
    world = np.asarray(view.camera.camera_from_world, float)
    eye = -world[:3, :3].T @ world[:3, 3]
    towards = eye - means[0].astype(float)
    at_rest = np.einsum("bac,bc->ba", of_joint[np.asarray(body.blobs.joints)], towards) @ world_from_upright(up)
    azimuth = np.arctan2(at_rest[:, 1], at_rest[:, 0])
    return np.round(azimuth / (2.0 * np.pi / SIDES)).astype(int) % SIDES


@eqx.filter_jit
def _frames_and_means(
    body: Body, pose: Float[Array, "dof"]
) -> tuple[Float[Array, "joint 4 4"], Float[Array, "blob 3"]]:
    frames = body.skeleton.world_from_joint(pose)
    return frames, body.blobs.points_world(frames)


def consistent_ways(fits: Sequence[Sequence[float]], colors: Sequence[Sequence[SideColors]]) -> tuple[int, ...]:
    """Which of the ways to see each moment to believe: those that fit, and show the same colours on the same sides.

    Args:
        fits: by moment and way how well it fits; only its ratio to the best counts.
        colors: by moment and way what is then seen of the sides of the body.
    """
    best = [max(ways) for ways in fits]

    def worth(chosen: tuple[int, ...]) -> float:
        fit = np.mean([ways[k] / most for ways, most, k in zip(fits, best, chosen, strict=True)])
        return float(fit) - COLOR_WEIGHT * disagreement([ways[k] for ways, k in zip(colors, chosen, strict=True)])

    return max(product(*(range(len(ways)) for ways in fits)), key=worth)


def disagreement(colors: Sequence[SideColors]) -> float:
    """Mean squared deviation of what several moments show of the same sides, from their mean."""
    stacked = np.stack(colors)
    seen = np.isfinite(stacked[..., 0])
    counts = seen.sum(axis=0)
    mean = np.nansum(stacked, axis=0) / np.maximum(counts, 1)[..., None]
    squares = np.where(seen[..., None], (stacked - mean) ** 2, 0.0).sum()
    return float(squares / max(seen.sum(), 1))
