"""Who stands where the background is not known: told by colours that the cameras share, against each one's own room.

All cameras show the same clothes, hair and skin, and each of them another part of the room: what is common in front of
all backgrounds is somebody, what a camera also shows beside him is the room.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.ndimage import gaussian_filter

from sogjax.model.camera import Camera
from sogjax.scene.background_difference import widened
from sogjax.scene.visual_hull import MANY, SIDE, VOXELS, Cube, VoxelPixels, cube_around, voxel_pixels, without_floor

COLOR_BINS = 24
"""Bins of each channel: brown hair is not a brown floor."""
BLUR = 0.7
"""Standard deviation of a colour, in bins."""
ANY_COLOR = 0.05
"""Share of pixels whose colour says nothing."""
NEAR = 0.12
"""How far beside the subject a camera's room is looked at, as a share of the picture's longer side: what is behind the
subject is likely to look the same."""
PIXELS = 1.0
"""Standard deviation in pixels over which colours are told together."""
LEAST, DECISIVE = 0.1, 0.5
"""Logarithms of odds from which on a camera alone says that a pixel is the subject's, or the room's: what is not like
the room is the subject if the others show its colours."""
UNLIKELY, LIKELY = 2.0, 0.7
"""Most that a camera says against a place and for it, logarithms of odds."""
MEAN, MAYBE = 0.3, 0.15
"""What the cameras that tell of a place must say on average for somebody to be there, where they count as half of all
at least, and for him not to be ruled out: what looks like the subject to few is a box of his colours; of seven, one
that clearly sees the wall in him does not cut him."""
CLEARLY = 1.5
"""Logarithm of odds from which on a pixel is the room's, whatever other cameras say: of people who talk in
`experiments/masks.py` one pixel in fifty looks so like it."""
VOTED = 0.7
"""Standard deviation in voxels over which places are told together: shirts have patterns."""
OWN = 0.1
"""A colour that the other cameras show this many times as often as a camera where it does not know its room, or less,
is not the subject's: it is of something that stands in front of that camera alone."""
ROUNDS = 3
"""How often colours and places follow from each other; after two, little changes."""
NONE = np.zeros(COLOR_BINS**3)

Counts = Float[np.ndarray, "bin"]
Mask = Bool[np.ndarray, "_h _w"]
Picture = UInt8[np.ndarray, "_h _w 3"]
Voxels = Bool[np.ndarray, "voxel"]


@dataclass(frozen=True)
class Scene:
    """One moment; everything by camera, of one size in each."""

    pictures: Mapping[int, Picture]
    masks: Mapping[int, Mask]
    """What is certainly not the background."""
    unknown: Mapping[int, Mask]
    """Where nothing is known of the background."""
    calm: Mapping[int, Mask]
    """Where nothing ever moves beside furniture, in what is unknown or anywhere: nobody is told by it."""

    def moving(self, camera: int) -> Mask:
        """What is unknown, and looked at."""
        return self.unknown[camera] & ~self.calm[camera]


@dataclass(frozen=True)
class SubjectColors:
    """Logarithm of how much likelier each colour is of the subject, by camera."""

    odds: Mapping[int, Float[np.ndarray, "bin"]]
    """Beside the room, and what stands in front of that camera."""
    beside_room: Mapping[int, Float[np.ndarray, "bin"]]
    """Beside the room alone: what stands in front tells nothing of the places behind it."""

    def decided(self, camera: int, scene: Scene) -> "Decided":
        """What the colours of one camera alone say; nothing where it is absent."""
        unknown, moving = scene.unknown[camera], scene.moving(camera)
        if camera not in self.odds:
            return Decided(np.zeros_like(unknown), unknown, unknown)
        odds = self.told(camera, scene.pictures[camera])
        subject = moving & (odds > LEAST)
        return Decided(subject, unknown & ~subject & ~(moving & (odds <= -DECISIVE)), unknown)

    def told(self, camera: int, picture: Picture) -> Float[np.ndarray, "_h _w"]:
        """The logarithm of the odds that a pixel shows the subject, from its colour and its neighbours'."""
        return self._told(self.odds[camera], picture)

    def told_of_places(self, camera: int, picture: Picture) -> Float[np.ndarray, "_h _w"]:
        """The logarithm of the odds against the room alone, as `told` otherwise."""
        return self._told(self.beside_room[camera], picture)

    @staticmethod
    def _told(table: Float[np.ndarray, "bin"], picture: Picture) -> Float[np.ndarray, "_h _w"]:
        each = table[_bins(picture)].astype(np.float32)
        return cv2.GaussianBlur(np.clip(each, -3.0, 3.0), (0, 0), PIXELS)


class Decided(NamedTuple):
    """What colours say of one camera's picture, where the background is unknown."""

    subject: Mask
    """What is the subject."""
    untold: Mask
    """What may be either."""
    possible: Mask
    """Where all cameras together, if these are many, do not rule somebody out, whatever this one sees."""


@dataclass(frozen=True)
class _Space:
    """Where somebody may be in one moment."""

    scene: Scene
    pixels: Mapping[int, VoxelPixels]
    open: Voxels
    """What no camera rules out."""


def subject_colors(
    scenes: Sequence[Scene], cameras: Mapping[int, Camera], up: Float[np.ndarray, "3"]
) -> SubjectColors | None:
    """Learn the colours from some moments of the same people; None where cameras do not show anybody together.

    A camera that shows nothing of the room beside them is absent. The cameras are those of pictures of the masks' size.
    """
    found = _learnt([space for scene in scenes if (space := _space(scene, cameras, up)) is not None], cameras)
    return None if found is None else found[0]


def decided_together(
    scene: Scene, cameras: Mapping[int, Camera], up: Float[np.ndarray, "3"]
) -> dict[int, Decided] | None:
    """What colours say of one moment, by camera; None where cameras do not show anybody together.

    A shirt that looks like the wall behind it to one camera, and a box that looks like a shirt, are told by the others,
    if there are many. Beside furniture each decides alone: too few see legs behind a table.
    """
    space = _space(scene, cameras, up)
    found = None if space is None else _learnt([space], cameras)
    if space is None or found is None:
        return None
    colors, (body,) = found
    decided = {k: colors.decided(k, scene) for k in scene.unknown}
    furnished = any(mask.any() for mask in scene.calm.values())
    if len(space.pixels) < MANY or furnished or not body.any():
        return decided
    maybe = _maybe(space, colors)
    told = [k for k in decided if k in colors.odds and k in space.pixels]
    return decided | {k: _with_others(decided[k], k, space, colors, (body, maybe)) for k in told}


def _with_others(
    alone: Decided, camera: int, space: _Space, colors: SubjectColors, bodies: tuple[Voxels, Voxels]
) -> Decided:
    """What a camera alone says, corrected by where somebody is, and may be, by all together.

    It decides outside of the space that is looked at, at most a voxel beside somebody, and where it clearly sees the
    room in him.
    """
    pixels, scene = space.pixels[camera], space.scene
    inside, possible, looked_at = (pixels.silhouette_of(each) for each in (*bodies, np.ones_like(space.open)))
    like_room = colors.told(camera, scene.pictures[camera]) < -CLEARLY
    own = alone.subject & (widened(inside, pixels.footprint) | ~looked_at)
    subject = own | (scene.moving(camera) & inside & ~like_room)
    maybe = widened(possible, pixels.footprint // 2) | ~looked_at
    return Decided(subject, alone.untold & ~subject, scene.unknown[camera] & maybe)


def _learnt(spaces: Sequence[_Space], cameras: Mapping[int, Camera]) -> tuple[SubjectColors, list[Voxels]] | None:
    """The colours, and where the subject is in each moment by them; None where no room is seen beside him."""
    rooms = {k: sum((_beside(space, k) for space in spaces if k in space.pixels), NONE) for k in cameras}
    room = {k: counts for k, counts in rooms.items() if counts.any()}
    if not room:
        return None
    certain = sum((_in_masks(space) for space in spaces), NONE)
    bodies, found = [space.open for space in spaces], SubjectColors({}, {})
    for _ in range(ROUNDS):
        both = list(zip(spaces, bodies, strict=True))
        mixed = {k: sum((_covered(*each, k) for each in both if k in each[0].pixels), NONE) for k in room}
        left = {k: _unmixed(mixed[k], room[k]) for k in room}
        every = sum(left.values(), certain)
        own = {k: _density(every - left[k]) for k in room}
        other = {k: np.maximum(_density(room[k]), OWN * _density(left[k])) for k in room}
        odds = {k: np.log(own[k] / other[k]) for k in room}
        found = SubjectColors(odds, {k: np.log(own[k] / _density(room[k])) for k in room})
        bodies = [_body(space, found) for space in spaces]
    return found, bodies


def _space(scene: Scene, cameras: Mapping[int, Camera], up: Float[np.ndarray, "3"]) -> _Space | None:
    """What all cameras allow around their masks, in voxels that are as small as its size permits."""
    touched = {k: _touched(mask, scene.unknown[k]) for k, mask in scene.masks.items() if mask.any()}
    regions = {k: mask for k, mask in scene.unknown.items() if mask.any()} | touched
    if len(regions) < 2:
        return None
    around = touched if len(touched) >= 2 else regions
    cube = cube_around(list(around.values()), [cameras[k] for k in around])
    for last in (False, True):
        pixels = {k: voxel_pixels(cube, cameras[k], region.shape) for k, region in regions.items()}
        misses = np.sum([~pixels[k].hits(widened(region, 1)) for k, region in regions.items()], axis=0)
        shown = np.sum([pixels[k].inside for k in regions], axis=0)
        hull = without_floor((misses <= (1 if len(regions) >= MANY else 0)) & (shown >= 2), up)
        if not hull.any():
            return None
        if not last:
            ends = np.array([cube.points[hull].min(axis=0), cube.points[hull].max(axis=0)])
            cube = Cube(ends.mean(axis=0), float(np.ptp(ends, axis=0).max() + 2.0 * cube.spacing) / SIDE)
    return _Space(scene, pixels, hull)


def _touched(mask: Mask, unknown: Mask) -> Mask:
    """The mask, with what is unknown beside it."""
    _, labels = cv2.connectedComponents((mask | unknown).astype(np.uint8), connectivity=8)
    return np.isin(labels, np.unique(labels[mask])) & (mask | unknown)


def _unmixed(mixed: Counts, room: Counts) -> Counts:
    """What is left of some pixels' colours without as much of the room as most of its colours allow."""
    share = room / max(float(room.sum()), 1.0)
    order = np.argsort(mixed / np.maximum(share, 1e-12))
    middle = order[min(int(np.searchsorted(np.cumsum(share[order]), 0.5)), len(order) - 1)]
    return np.maximum(mixed - mixed[middle] / max(float(share[middle]), 1e-12) * share, 0.0)


def _beside(space: _Space, camera: int) -> Counts:
    """The colours of the room near where somebody may be, and of what never moves in front of it."""
    scene, open_ = space.scene, space.pixels[camera].silhouette_of(space.open)
    away = cv2.distanceTransform((~open_).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    near = away <= NEAR * max(open_.shape)
    return _counts(scene.pictures[camera], near & ~scene.masks[camera] & ~(scene.moving(camera) & open_))


def _in_masks(space: _Space) -> Counts:
    """The colours of what is certainly the subject, in all cameras."""
    return sum((_counts(space.scene.pictures[k], space.scene.masks[k]) for k in space.pixels), NONE)


def _covered(space: _Space, body: Voxels, camera: int) -> Counts:
    """The colours where somebody is seen before what is unknown, if he is a `body`."""
    moving = space.scene.moving(camera)
    return _counts(space.scene.pictures[camera], moving & space.pixels[camera].silhouette_of(body))


def _body(space: _Space, colors: SubjectColors) -> Voxels:
    """The places that the cameras together give to the subject."""
    said, telling = _said(space, colors)
    return space.open & (said >= MEAN * np.maximum(telling, 0.5 * len(space.pixels)))


def _maybe(space: _Space, colors: SubjectColors) -> Voxels:
    """The places that they do not rule out."""
    said, telling = _said(space, colors)
    return space.open & (said >= MAYBE * telling)


def _said(space: _Space, colors: SubjectColors) -> tuple[Float[np.ndarray, "voxel"], Float[np.ndarray, "voxel"]]:
    """What all cameras together say for each place, and how many tell of it."""
    said, telling = np.zeros((2, len(space.open)), np.float32)
    for k, pixels in ((k, space.pixels[k]) for k in space.pixels if k in colors.odds):
        odds, unknown = colors.told_of_places(k, space.scene.pictures[k]), space.scene.moving(k)
        shown = np.where(unknown, np.clip(odds, -UNLIKELY, LIKELY), np.where(space.scene.masks[k], LIKELY, 0.0))
        told = pixels.shows(unknown | space.scene.masks[k])
        said += np.where(told, shown[pixels.rows, pixels.columns], 0.0).astype(np.float32)
        telling += told
    around = lambda values: gaussian_filter(values.reshape(3 * (VOXELS,)), VOTED).ravel()
    return around(said), around(telling)


def _bins(picture: Picture) -> Int[np.ndarray, "_h _w"]:
    each = (picture.astype(np.int64) * COLOR_BINS) >> 8
    return (each[..., 0] * COLOR_BINS + each[..., 1]) * COLOR_BINS + each[..., 2]


def _counts(picture: Picture, mask: Mask) -> Counts:
    """How many pixels have each colour, a little blurred."""
    found = np.bincount(_bins(picture)[mask], minlength=COLOR_BINS**3).astype(float)
    return gaussian_filter(found.reshape(3 * (COLOR_BINS,)), BLUR).ravel()


def _density(counts: Counts) -> Counts:
    """The density of colours, relative to that of any colour."""
    return (1.0 - ANY_COLOR) * counts * COLOR_BINS**3 / max(float(counts.sum()), 1.0) + ANY_COLOR
