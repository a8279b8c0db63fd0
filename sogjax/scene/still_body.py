"""Somebody who stands still in a clip, told by being seen in one colour from all sides.

Through a place that is empty each camera sees another part of the room; through a leg all of them see its trousers. So
places under and over what moves are somebody's, where most cameras see the same colour there, lit as it may be. The
floor is seen alike by all cameras, too: it goes on around the person, and cameras show it to each other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.ndimage import label

from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import disc, opened, widened
from sogjax.scene.coarse_views import CoarseViews, enlarged
from sogjax.scene.floor import Floor, over_floor
from sogjax.scene.foreground import own_color
from sogjax.scene.moving_zone import CORE, NEAR, REACH, TALLEST, WHOLE_BODY, convex, moving_height
from sogjax.scene.visual_hull import MANY, VoxelPixels, from_upright, upright

ALIKE, AGREEING = 0.5, 0.7
"""How like the median colour a camera must see a place, 0 to 1; and the share of the cameras that must, as somebody
else may be before some."""
LEAST_HEIGHT, SHOES = 0.35, 0.35
"""Metres: what is less high is no leg; and a leg begins so far above the floor, whose colour shoes may have."""
NARROWEST, WIDEST = 0.1, 0.9
"""Metres on the floor that legs take, with the ground between them; a table's leg takes less, a table more."""
TOPS, LARGE = (0.4, 1.0), 0.3
"""Metres over the floor between which the top of a table is, and square metres that it has at one level: tops that were
seen have 0.45 to 0.75, what else is at such heights at most 0.18."""
HEAD, OVER_SHOULDERS, HEAD_AGREEING = 0.17, 0.13, 0.55
"""Metres: how far around its middle a head may be, and how far that is over the highest place that moves over legs; and
the share of the cameras that must see a place there in one colour: some see the face, others hair. Of six heads 58 to
94 % of the places are seen so, of those around them 3 to 25 %."""
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


def still_bodies(views: CoarseViews, floors: Mapping[int, Floor]) -> dict[int, Standing]:
    """Where each camera shows somebody who stands still; nowhere, if fewer than five cameras see anything move.

    `floors` are what cameras show of the floor to each other (`seen_floors`).
    """
    nowhere = {k: Standing(np.zeros_like(mask), np.zeros_like(mask)) for k, mask in views.movements.items()}
    if len(views.moving) < MANY:
        return nowhere
    misses = np.sum([*views.missed(views.moving).values()], axis=0)
    moving = upright(views.inside & (misses <= 1), views.up)
    if not moving.any():
        return nowhere
    colors, share = _one_color([(views.small_picture(k), at) for k, at in views.pixels.items()])
    alike = upright(views.inside & (share >= AGREEING), views.up)
    spacing = views.cube.spacing
    trunks, plan = _trunks(moving, spacing)
    empty, ground = _floor_by_color(alike, colors, trunks, views.up, spacing)
    if floors:
        over = over_floor(views, floors)
        empty, ground = over.empty | (empty & ~over.told), over.level
    body = alike & plan[:, :, None] & _heights(moving, spacing)
    legs = legs_of(body & ~empty, float(ground), spacing)
    heads = heads_over(legs, moving, spacing) & upright(views.inside & (share >= HEAD_AGREEING), views.up)
    still = from_upright(legs | heads, views.up)
    shown = {k: at.silhouette_of(still) for k, at in views.pixels.items()}
    rim = {k: round(RIM / spacing * at.footprint) for k, at in views.pixels.items()}
    large = lambda k, mask: views.enlarged(k, mask) & ~views.movements[k]
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


def _trunks(
    moving: Bool[np.ndarray, "x y z"], spacing: float
) -> tuple[Bool[np.ndarray, "x y"], Bool[np.ndarray, "x y"]]:
    """Seen from above: where a body moves, or parts of it, and the places around that belong to it."""
    heights = moving.sum(axis=2)
    whole = moving_height(moving) * spacing >= WHOLE_BODY
    trunks = (heights > 0) & (heights >= (CORE if whole else 0.0) * heights.max())
    return trunks, convex(trunks, (NEAR if whole else REACH) / spacing)


def _heights(moving: Bool[np.ndarray, "x y z"], spacing: float) -> Bool[np.ndarray, "z"]:
    """The levels at which a body may be."""
    top, levels = round(float(np.percentile(np.nonzero(moving)[2], 99))), np.arange(moving.shape[2])
    return (levels <= top) & (levels >= round(top - TALLEST / spacing))


def _floor_by_color(
    alike: Bool[np.ndarray, "x y z"],
    colors: Float[np.ndarray, "voxel 3"],
    trunks: Bool[np.ndarray, "x y"],
    up: Float[np.ndarray, "3"],
    spacing: float,
) -> tuple[Bool[np.ndarray, "x y z"], float]:
    """What has the colour of the floor, which is at the level that is seen in one colour around trunks; and that level.

    Nothing, where no level is.
    """
    wide = lambda reach: cv2.dilate(trunks.astype(np.uint8), disc(2 * round(reach / spacing) + 1)) > 0
    ring = wide(BEYOND) & ~wide(AROUND)
    shares = (alike & ring[:, :, None]).sum(axis=(0, 1)) / max(ring.sum(), 1)
    floor, number = int(np.argmax(shares)), upright(np.arange(len(colors)), up)
    if shares[floor] < FLOOR:
        return np.zeros_like(alike), np.inf
    its_color = np.median(colors[number[:, :, floor][ring & alike[:, :, floor]]], axis=0)
    return _alike(colors, its_color)[number], float(floor)


def legs_of(still: Bool[np.ndarray, "x y z"], ground: float, spacing: float) -> Bool[np.ndarray, "x y z"]:
    """The connected parts that stand on the ground (a level) as legs do: high, and not wide.

    None beside a table: a chair is as high and wide as legs. Where the floor is not known, tables are not told.
    """
    connected: Any = label(still)
    labels: Int[np.ndarray, "x y z"] = connected[0]
    places = [spacing * np.argwhere(labels == part) for part in range(1, connected[1] + 1)]
    if any(_is_top(of_part, ground * spacing, spacing) for of_part in places):
        return np.zeros_like(still)
    kept = [_stands(of_part, ground * spacing, spacing) for of_part in places]
    return still & np.isin(labels, np.flatnonzero(kept) + 1)


def heads_over(
    legs: Bool[np.ndarray, "x y z"], moving: Bool[np.ndarray, "x y z"], spacing: float
) -> Bool[np.ndarray, "x y z"]:
    """Where heads may be: balls over the highest places that move over the legs of somebody."""
    plan = legs.sum(axis=2) > 0
    connected: Any = label(widened(plan, round(0.5 * NEAR / spacing)))
    heads, at = np.zeros_like(legs), np.indices(legs.shape)
    for part in range(1, connected[1] + 1):
        middle = np.argwhere(plan & (connected[0] == part)).mean(axis=0)
        near = np.hypot(*(at[:2, :, :, 0] - middle[:, None, None])) * spacing <= NEAR
        levels = np.flatnonzero((moving & near[:, :, None]).any(axis=(0, 1)))
        if levels.size:
            centre = np.append(middle, levels[-1] + OVER_SHOULDERS / spacing)
            heads |= np.linalg.norm(at - centre[:, None, None, None], axis=0) * spacing <= HEAD
    return heads


def _stands(places: Float[np.ndarray, "place 3"], floor: float, spacing: float) -> bool:
    """Whether a part is as high and wide as legs and reaches down to the floor, at most to its shoes; metres."""
    *wide, high = np.ptp(places, axis=0) + spacing
    low = places[:, 2].min() <= floor + SHOES
    return bool(low and high >= LEAST_HEIGHT and NARROWEST <= max(wide) <= WIDEST)


def _is_top(places: Float[np.ndarray, "place 3"], floor: float, spacing: float) -> bool:
    """Whether a part holds what may be the top of a table: it is large at some height, and not beneath; metres."""
    levels, counts = np.unique(places[:, 2], return_counts=True)
    large = levels[spacing**2 * counts >= LARGE] - floor
    lowest, highest = TOPS
    return bool(large.size and lowest <= large.min() and large.max() <= highest)


def with_room_behind(
    background: BackgroundImage,
    somebody: Standing,
    moving: Mask,
    shown: UInt8[np.ndarray, "_h _w 3"],
    floor: Floor | None = None,
) -> BackgroundImage:
    """The background, which goes on behind somebody who stands still as it is around him, or as others show the floor.

    Not as it is where something is `moving`. In the rim, what is `shown` all the time and looks like that is the room
    itself. Where somebody surely stands and looks like it, nothing is known.
    """
    if not somebody.perhaps.any():
        return background
    left_out = somebody.perhaps | moving | ~background.known
    around = cv2.inpaint(background.picture, left_out.astype(np.uint8), INPAINTED, cv2.INPAINT_TELEA)
    other = ~_alike(shown / np.float32(255.0), around / np.float32(255.0))
    if floor is not None:
        size = shown.shape[1::-1]
        known, off = (enlarged(mask, moving.shape) for mask in (floor.known, ~floor.shown(shown)))
        around = np.where(known[..., None], cv2.resize(floor.picture, size, interpolation=cv2.INTER_LINEAR), around)
        other = np.where(known, off, other)
    hiding = opened(somebody.perhaps & other, 3)
    room, unsure = somebody.perhaps & ~somebody.surely & ~hiding, somebody.surely & ~hiding
    picture = np.where(hiding[..., None], around, np.where(room[..., None], shown, background.picture))
    spread = np.where(hiding, np.float32(GUESSED_SPREAD), background.spread)
    return replace(background, picture=picture, spread=spread, known=(background.known | hiding | room) & ~unsure)
