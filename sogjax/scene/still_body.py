"""Somebody who stands still in a clip, told by being seen in one colour from all sides.

Through a place that is empty each camera sees another part of the room; through a leg all of them see its trousers. So
places under and over what moves are somebody's, where most cameras see the same colour there, lit as it may be. The
floor is seen alike by all cameras, too: it goes on around the person.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.ndimage import label

from sogjax.model.camera import Camera
from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import disc, opened, widened
from sogjax.scene.coarse_views import CoarseViews, enlarged, small
from sogjax.scene.foreground import own_color
from sogjax.scene.moving_zone import CORE, NEAR, REACH, TALLEST, WHOLE_BODY, convex, moving_height
from sogjax.scene.visual_hull import MANY, VoxelPixels, from_upright, upright

ALIKE, AGREEING = 0.5, 0.7
"""How like the median colour a camera must see a place, 0 to 1; and the share of the cameras that must, as somebody
else may be before some."""
LEAST_HEIGHT, SHOES = 0.35, 0.35
"""Metres: what is less high is no leg; and a leg begins so far above the floor, whose colour shoes may have."""
RIM = 0.08
"""Metres around what is seen in one colour that may be somebody, too: at its edge, some cameras look past it."""
INPAINTED = 5
"""Pixels around a place that tell how the room goes on there."""
GUESSED_SPREAD = 12.0
"""Grey levels: standard deviation of a room that is continued behind somebody."""
AROUND, BEYOND = 0.35, 0.8
"""Metres from a trunk between which the floor is looked at."""
FLOOR = 0.5
"""Share of the places there at the floor's height that are seen in one colour, from which on that is the floor's."""

Mask = Bool[np.ndarray, "_h _w"]
Picture = UInt8[np.ndarray, "_h _w 3"]


class Standing(NamedTuple):
    """Where a camera shows somebody who stands still, and where it may."""

    surely: Mask
    perhaps: Mask
    """What is surely somebody, and its rim."""


def still_bodies(
    movements: Mapping[int, Mask],
    pictures: Mapping[int, Picture],
    cameras: Mapping[int, Camera],
    up: Float[np.ndarray, "3"],
) -> dict[int, Standing]:
    """Where each camera shows somebody who stands still; nowhere, if fewer than five cameras see anything move.

    By camera, `movements` are where anything moves in the clip, and `pictures` (BGR) are typical ones of it.
    """
    nowhere = {k: Standing(np.zeros_like(mask), np.zeros_like(mask)) for k, mask in movements.items()}
    views = CoarseViews.of(movements, cameras)
    if views is None or len(views.moving) < MANY:
        return nowhere
    misses = np.sum([*views.missed(views.moving).values()], axis=0)
    moving = upright(views.inside & (misses <= 1), up)
    if not moving.any():
        return nowhere
    colors, share = _one_color([(small(pictures[k], cv2.INTER_AREA), at) for k, at in views.pixels.items()])
    alike = upright(views.inside & (share >= AGREEING), up)
    still = from_upright(_still(moving, alike, colors, up, views.cube.spacing), up)
    shown = {k: at.silhouette_of(still) for k, at in views.pixels.items()}
    rim = {k: round(RIM / views.cube.spacing * at.footprint) for k, at in views.pixels.items()}
    large = lambda k, mask: enlarged(mask, movements[k].shape) & ~movements[k]
    return nowhere | {k: Standing(large(k, mask), large(k, widened(mask, rim[k]))) for k, mask in shown.items()}


def _one_color(
    views: Sequence[tuple[Picture, VoxelPixels]],
) -> tuple[Float[np.ndarray, "voxel 3"], Float[np.ndarray, "voxel"]]:
    """The median colour (0 to 1) in which voxels are seen, and the share of the cameras that see them so."""
    seen = np.stack([picture[at.rows, at.columns] for picture, at in views]) / np.float32(255.0)
    inside = np.stack([at.inside for _, at in views])
    colors, partly = np.median(seen, axis=0), inside.any(axis=0) & ~inside.all(axis=0)
    colors[partly] = np.nanmedian(np.where(inside[:, partly, None], seen[:, partly], np.nan), axis=0)
    return colors, np.average(_alike(seen, colors), axis=0, weights=inside + np.float32(1e-6))


def _alike(seen: Float[np.ndarray, "*n 3"], color: Float[np.ndarray, "*m 3"]) -> Bool[np.ndarray, "*n"]:
    """Which colours are the same, lit as they may be."""
    expected = color.reshape((1,) * (seen.ndim - color.ndim) + color.shape)
    return np.asarray(own_color(jnp.asarray(seen), jnp.asarray(expected)) > ALIKE)


def _still(
    moving: Bool[np.ndarray, "x y z"],
    alike: Bool[np.ndarray, "x y z"],
    colors: Float[np.ndarray, "voxel 3"],
    up: Float[np.ndarray, "3"],
    spacing: float,
) -> Bool[np.ndarray, "x y z"]:
    """What is seen in one colour around what moves, as high as legs; not the floor."""
    heights = moving.sum(axis=2)
    whole = moving_height(moving) * spacing >= WHOLE_BODY
    trunks = (heights > 0) & (heights >= (CORE if whole else 0.0) * heights.max())
    plan = convex(trunks, (NEAR if whole else REACH) / spacing)
    wide = lambda reach: cv2.dilate(trunks.astype(np.uint8), disc(2 * round(reach / spacing) + 1)) > 0
    ring = wide(BEYOND) & ~wide(AROUND)
    top = round(float(np.percentile(np.nonzero(moving)[2], 99)))
    body = alike & plan[:, :, None]
    body[:, :, top + 1 :] = False
    body[:, :, : max(round(top - TALLEST / spacing), 0)] = False
    shares = (alike & ring[:, :, None]).sum(axis=(0, 1)) / max(ring.sum(), 1)
    floor, number = int(np.argmax(shares)), upright(np.arange(len(colors)), up)
    seen_floor = shares[floor] >= FLOOR
    if seen_floor:
        its_color = np.median(colors[number[:, :, floor][ring & alike[:, :, floor]]], axis=0)
        body &= ~_alike(colors, its_color)[number]
    connected: Any = label(body)
    labels: Int[np.ndarray, "x y z"] = connected[0]
    ground = floor * spacing if seen_floor else np.inf
    kept = [_stands(np.nonzero(labels == k)[2] * spacing, ground) for k in range(1, connected[1] + 1)]
    return body & np.isin(labels, np.flatnonzero(kept) + 1)


def _stands(heights: Float[np.ndarray, "place"], floor: float) -> bool:
    """Whether a part is as high as a leg and reaches down to the floor, at most to its shoes; metres."""
    return bool(np.ptp(heights) >= LEAST_HEIGHT and heights.min() <= floor + SHOES)


def with_room_behind(
    background: BackgroundImage, somebody: Standing, moving: Mask, shown: UInt8[np.ndarray, "_h _w 3"]
) -> BackgroundImage:
    """The background, which goes on behind somebody who stands still as it is around him.

    Not as it is where something is `moving`. In the rim, what is `shown` all the time and looks like that is the room
    itself. Where somebody surely stands and looks like it, nothing is known.
    """
    if not somebody.perhaps.any():
        return background
    left_out = somebody.perhaps | moving | ~background.known
    around = cv2.inpaint(background.picture, left_out.astype(np.uint8), INPAINTED, cv2.INPAINT_TELEA)
    other = ~_alike(shown / np.float32(255.0), around / np.float32(255.0))
    hiding = opened(somebody.perhaps & other, 3)
    room, unsure = somebody.perhaps & ~somebody.surely & ~hiding, somebody.surely & ~hiding
    picture = np.where(hiding[..., None], around, np.where(room[..., None], shown, background.picture))
    spread = np.where(hiding, np.float32(GUESSED_SPREAD), background.spread)
    return replace(background, picture=picture, spread=spread, known=(background.known | hiding | room) & ~unsure)
