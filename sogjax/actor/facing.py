"""Front or back: what silhouettes of one moment hardly tell, several of them tell together.

Somebody shows the same colours on the same sides, and does not turn round in an instant.
"""

from collections.abc import Sequence
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.colors import ColoredView, blob_samples
from sogjax.model.body import Body
from sogjax.model.program import compiled
from sogjax.model.rotation import world_from_upright
from sogjax.search.placed_body import root_rotations

SIDES = 4
"""Sides of the body that are told apart: front, left, back and right."""
FEWEST_SAMPLES = 6
"""Samples of a blob in one picture that it takes to say what colour it has on that side."""

COLOR_WEIGHT = 2.0
"""Weight of the squared deviation of colours against a share of the fit. Somebody seen back to front in one of five
moments loses 0.3 % of the fit, and colours then deviate by 0.0015 more."""

TURNING = np.deg2rad(200.0)
"""Radians per second by which somebody turns without more ado."""
TURN_WEIGHT = 0.03
"""What half a turn beyond that costs against a share of the fit, which is 1 to 5 % less back to front."""

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


@compiled
def _frames_and_means(
    body: Body, pose: Float[Array, "dof"]
) -> tuple[Float[Array, "joint 4 4"], Float[Array, "blob 3"]]:
    frames = body.skeleton.world_from_joint(pose)
    return frames, body.blobs.points_world(frames)


def forward(body: Body, poses: Sequence[Float[Array | np.ndarray, "dof"]], up: str) -> Float[np.ndarray, "pose 3"]:
    """Where the body's trunk faces in each pose (world); `body` stands upright in a world of vertical `up`."""
    turns = root_rotations(body, np.stack([*poses, body.poses["rest"]]))
    return turns[:-1] @ turns[-1].T @ world_from_upright(up)[:, 0]


class Way(NamedTuple):
    """A way to see the subject of one moment."""

    fit: float
    """How well it fits; only its ratio to that of the best way of its moment counts."""
    forward: Float[np.ndarray, "3"]
    """Where the trunk faces (world)."""
    colors: SideColors | None = None
    """What is then seen of the sides of the body, where that is asked for."""


def consistent_ways(moments: Sequence[Sequence[Way]], times: Sequence[float | None]) -> tuple[int, ...]:
    """Which way of each moment to believe: those that fit, show the same colours on the same sides, and turn slowly.

    `times` are those of the moments (seconds); None: not of the clip.
    """
    best = [max(way.fit for way in ways) for ways in moments]

    def worth(chosen: tuple[int, ...]) -> float:
        believed = [ways[k] for ways, k in zip(moments, chosen, strict=True)]
        fit = np.mean([way.fit / most for way, most in zip(believed, best, strict=True)])
        colors = [way.colors for way in believed if way.colors is not None]
        turned = TURN_WEIGHT * haste([way.forward for way in believed], times) / len(moments)
        return float(fit) - turned - (COLOR_WEIGHT * disagreement(colors) if colors else 0.0)

    return max(product(*(range(len(ways)) for ways in moments)), key=worth)


def haste(forward: Sequence[Float[np.ndarray, "3"]], times: Sequence[float | None]) -> float:
    """By how many half turns somebody turns more than at `TURNING`, from each moment of the clip to the next."""
    known = sorted((time, k) for k, time in enumerate(times) if time is not None)
    beyond = [
        np.arccos(np.clip(np.dot(forward[one], forward[two]), -1.0, 1.0)) - TURNING * (later - time)
        for (time, one), (later, two) in pairwise(known)
    ]
    return float(np.sum(np.maximum(beyond, 0.0))) / np.pi


def disagreement(colors: Sequence[SideColors]) -> float:
    """Mean squared deviation of what several moments show of the same sides, from their mean."""
    stacked = np.stack(colors)
    seen = np.isfinite(stacked[..., 0])
    counts = seen.sum(axis=0)
    mean = np.nansum(stacked, axis=0) / np.maximum(counts, 1)[..., None]
    squares = np.where(seen[..., None], (stacked - mean) ** 2, 0.0).sum()
    return float(squares / max(seen.sum(), 1))
