"""The floor as cameras show it to each other: what one does not see of it for a leg, the others do.

A plane maps one camera's picture to another's. So each place of the floor is seen by all cameras that nothing hides it
from, and their median is the empty floor, though somebody stood on it all the time. At which height it lies is where
the cameras agree most.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, UInt8
from scipy.ndimage import distance_transform_edt

from sogjax.model.camera import Camera, undistort
from sogjax.model.cores import in_threads
from sogjax.scene.background import BackgroundImage, local_contrast
from sogjax.scene.background_difference import channel_max, opened
from sogjax.scene.coarse_views import CoarseViews, enlarged, small
from sogjax.scene.plane_view import FEWEST_SEEING, PlaneView, from_others, pixel_grid, sampled
from sogjax.scene.visual_hull import VOXELS, resized, upright

BELOW, ABOVE, STEP = 2.0, 0.3, 0.02
"""Metres under and over the middle of what moves between which the floor is looked for, and how finely."""
WITHIN = 1.5
"""Metres from the middle of what moves, on the floor, in which heights are compared."""
COMPARED, LIT = 37, 5
"""One pixel in so many is compared at each height, and tells the light."""
CLEARER = 0.6
"""How much less cameras must differ at the floor's height than they do at others; a floor without any pattern does not
tell its height."""
AGREED = 12.0
"""Grey levels, standard deviation over cameras, up to which they show the same floor."""
LEAST_APART, BY_SPREAD, BY_CONTRAST = 6.0, 1.5, 0.15
"""Difference up to which a picture shows the floor: grey levels, of what the cameras differ by, of what neighbouring
pixels do."""
MISTAKEN = 1 / 8
"""Share of the cameras that may take something for the floor."""
FEWEST_SHOWN = 3
"""Samples that must show the floor before it counts as uncovered."""
AT_ONCE = 2
"""Cameras of which the floor is put together at the same time: each takes what all others show, tens of MB."""

Mask = Bool[np.ndarray, "_h _w"]
Picture = UInt8[np.ndarray, "_h _w 3"]


@dataclass(frozen=True)
class Floor:
    """The floor where the others show it to a camera, at the small size (`small`)."""

    picture: Picture
    """BGR, in this camera's light; where nothing is known of the floor, as the nearest place of it."""
    tolerance: Float[np.ndarray, "_h _w"]
    """Difference up to which a pixel shows it, grey levels."""
    known: Mask
    """Where the other cameras tell how it looks."""
    height: float
    """Where it lies along the vertical, metres."""

    def shown(self, picture: UInt8[np.ndarray, "_rows _columns 3"]) -> Mask:
        """Where a picture of the clip's size, or of that of its samples, shows the floor, at the small size."""
        apart = channel_max(cv2.absdiff(small(picture, cv2.INTER_AREA), self.picture))
        return self.known & (apart <= self.tolerance)


def with_floor(
    background: BackgroundImage, floor: Floor | None, images: Sequence[UInt8[np.ndarray, "rows columns 3"]], zone: Mask
) -> BackgroundImage:
    """The background, which is the floor where some samples show it, and unknown where the floor is always hidden.

    What is hidden and narrower than three small pixels stays as it was learnt.

    Args:
        background: learnt from the samples; at their size.
        floor: what the other cameras show of it; None: nothing.
        images: the samples.
        zone: where the subject may stand; elsewhere nothing is changed.
    """
    if floor is None:
        return background
    large = lambda mask: enlarged(mask, zone.shape) & zone
    seen = np.sum([floor.shown(image) for image in images], axis=0) >= FEWEST_SHOWN
    uncovered, hidden = large(seen), large(opened(floor.known & ~seen, 3))
    other = uncovered & ~(background.known & large(floor.shown(background.picture)))
    size = zone.shape[::-1]
    picture, tolerance = (
        cv2.resize(part, size, interpolation=cv2.INTER_LINEAR) for part in (floor.picture, floor.tolerance)
    )
    return replace(
        background,
        picture=np.where(other[..., None], picture, background.picture),
        spread=np.where(other, np.maximum(0.5 * tolerance, background.spread), background.spread),
        known=(background.known | uncovered) & ~hidden,
    )


def seen_floors(views: CoarseViews) -> dict[int, Floor]:
    """The floor around what moves, by camera; none where fewer than four cameras see that, or they agree on none."""
    if len(views.moving) <= FEWEST_SEEING:
        return {}
    cameras, up = views.cameras, views.up
    first = np.roll(np.abs(up), 1)
    axes = np.stack([first, np.cross(up, first), up], axis=1)
    seen = {k: PlaneView.of(views.small_picture(k), cameras[k], axes) for k in views.moving}
    *centre, middle = axes.T @ views.cube.centre
    height = _height(seen, np.array(centre), float(middle))
    if height is None:
        return {}
    lights = _lights(seen, height, np.array(centre))
    room = cv2.convexHull(np.array([one.place for one in seen.values()], np.float32))[:, 0]
    found = in_threads(lambda k: _floor(k, seen, lights, height, room, cameras[k]), seen, AT_ONCE)
    return dict(zip(seen, found, strict=True))


class OverFloor(NamedTuple):
    """What is told of the voxels of a room, upright, by where cameras show its floor."""

    empty: Bool[np.ndarray, "x y z"]
    """Those through which cameras see the floor; of many cameras one may be mistaken."""
    told: Bool[np.ndarray, "x y z"]
    """Those behind which some camera knows the floor."""
    level: int
    """At which the floor lies."""


def over_floor(views: CoarseViews, floors: Mapping[int, Floor]) -> OverFloor:
    """What the floors of cameras tell of the room over them."""
    through = np.sum([views.pixels[k].shows(floor.shown(views.pictures[k])) for k, floor in floors.items()], axis=0)
    told = np.any([views.pixels[k].shows(floor.known) for k, floor in floors.items()], axis=0)
    height = next(iter(floors.values())).height
    level = round((height - float(views.up @ views.cube.centre)) / views.cube.spacing + 0.5 * (VOXELS - 1))
    return OverFloor(upright(through > MISTAKEN * len(floors), views.up), upright(told, views.up), level)


def _near(
    one: PlaneView, height: float, centre: Float[np.ndarray, "2"], every: int
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Places of the plane near the centre that a camera shows in one pixel of so many, and their colours."""
    rows, columns = one.picture.shape[:2]
    places = one.on_plane(pixel_grid(rows, columns).reshape(-1, 2)[::every], height)
    own = one.picture.reshape(-1, 3)[::every]
    near = (np.linalg.norm(places[:, :2] - centre, axis=1) < WITHIN) & np.isfinite(own[:, 0])
    return places[near], own[near]


def _height(seen: Mapping[int, PlaneView], centre: Float[np.ndarray, "2"], middle: float) -> float | None:
    """At which height the cameras show the same; None: at none do they clearly more than at others."""
    heights = middle + np.arange(-BELOW, ABOVE, STEP)
    apart = np.array([_apart(seen, height, centre) for height in heights])
    if not np.isfinite(apart).any():
        return None
    best = int(np.nanargmin(apart))
    return float(heights[best]) if apart[best] < CLEARER * np.nanmedian(apart) else None


def _apart(seen: Mapping[int, PlaneView], height: float, centre: Float[np.ndarray, "2"]) -> float:
    """By how many grey levels cameras differ from the median of the others, where the plane at this height is seen."""
    off, lights = [], _one_light(seen)
    for k, one in seen.items():
        places, own = _near(one, height, centre, COMPARED)
        others = from_others(k, seen, lights, places, height)
        off.append(np.abs(own - others.colors).max(axis=1)[others.enough])
    every = np.concatenate(off)
    return float(np.median(every)) if len(every) else np.nan


def _one_light(seen: Mapping[int, PlaneView]) -> dict[int, Float[np.ndarray, "3"]]:
    """The lights of cameras that show everything alike."""
    return {k: np.ones(3, np.float32) for k in seen}


def _lights(
    seen: Mapping[int, PlaneView], height: float, centre: Float[np.ndarray, "2"]
) -> dict[int, Float[np.ndarray, "3"]]:
    """How bright each camera shows the floor, by channel, as a multiple of what the others do."""
    lights = _one_light(seen)
    for _ in range(2):
        found = {}
        for k, one in seen.items():
            places, own = _near(one, height, centre, LIT)
            others = from_others(k, seen, lights, places, height)
            sure = others.enough & (others.spread < AGREED)
            found[k] = np.median(own[sure] / np.maximum(others.colors[sure], 1.0), axis=0) if sure.any() else lights[k]
        lights = found
    return lights


def _floor(
    camera: int,
    seen: Mapping[int, PlaneView],
    lights: Mapping[int, Float[np.ndarray, "3"]],
    height: float,
    room: Float[np.ndarray, "corner 2"],
    lens: Camera,
) -> Floor:
    """What the others show of the floor of a room, which is the convex outline of where cameras stand."""
    one = seen[camera]
    rows, columns = one.picture.shape[:2]
    places = one.on_plane(pixel_grid(rows, columns), height)
    others = from_others(camera, seen, lights, np.where(_within(room, places)[..., None], places, np.nan), height)
    sure = others.enough & (others.spread < AGREED)
    told = np.where(sure[..., None], np.dstack([others.colors * lights[camera], others.spread]), np.nan)
    recorded, pixels = resized(lens, (columns, rows)), pixel_grid(rows, columns).reshape(-1, 2)
    straight = np.asarray(undistort(recorded, jnp.asarray(pixels))).reshape(rows, columns, 2)
    colors, spread = (sampled(part.astype(np.float32), straight) for part in (told[..., :3], told[..., 3:]))
    known = np.isfinite(colors[..., 0])
    colors, spread = _filled(colors, known), _filled(spread.reshape(rows, columns), known)
    picture = colors.clip(0, 255).round().astype(np.uint8)
    tolerance = LEAST_APART + BY_SPREAD * spread + BY_CONTRAST * local_contrast(picture)
    return Floor(picture, tolerance, known, height)


def _filled(values: np.ndarray, known: Mask) -> np.ndarray:
    """Values of a picture, elsewhere those of the nearest place where they are known; 0, where that is nowhere."""
    if not known.any():
        return np.zeros_like(values)
    rows, columns = distance_transform_edt(~known, return_distances=False, return_indices=True)  # pyright: ignore[reportGeneralTypeIssues]
    return values[rows, columns]


def _within(outline: Float[np.ndarray, "corner 2"], places: Float[np.ndarray, "*n 3"]) -> Bool[np.ndarray, "*n"]:
    """Which places lie in a convex outline."""
    inside = np.isfinite(places[..., 0])
    turn = 1.0 if cv2.contourArea(outline, True) > 0 else -1.0
    for (x, y), (next_x, next_y) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        inside &= turn * ((next_x - x) * (places[..., 1] - y) - (next_y - y) * (places[..., 0] - x)) >= 0
    return inside
