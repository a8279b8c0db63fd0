"""Masks of a subject from pictures of several cameras and of the empty scene."""

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.model.camera import Camera
from sogjax.model.cores import in_threads
from sogjax.scene.background_difference import (
    Difference,
    background_difference,
    closed,
    disc,
    reduced_mask,
    widened,
    without_holes,
    working_size,
)
from sogjax.scene.subject_colors import Decided, Scene, decided_together
from sogjax.scene.visual_hull import LOW_VOXELS, MANY, VoxelPixels, cube_around, resized, voxel_pixels, without_floor

LARGEST_SHARE = 0.5
"""Where more of a picture than this differs, the camera was moved or the light changed, and no subject can be found."""
SMALLEST_SHARE = 1e-3
"""Share of the picture below which a region is not a subject."""
SMALLEST_PART = 0.1
"""Parts of a mask smaller than this share of the largest one are dropped."""
GRAB_CUT_ITERATIONS = 2
COARSE_SIDE = 324
"""Longer side, in pixels, of pictures of which only a rough outline is wanted."""
UNCHANGED, CERTAIN = 3.0, 10.0
"""Squared differences, in units of the noise, below which a pixel is certainly background, and above which it is
certainly the subject where no shadow explains them."""

Mask = Bool[np.ndarray, "_h _w"]


class FoundMasks(NamedTuple):
    """What is found of a subject, by camera, at the pictures' size."""

    masks: dict[int, Mask]
    """A camera is absent if no subject could be told apart from its background."""
    by_colors: dict[int, Mask]
    """Where the background is unknown, all cameras, or all but one of many, allow the subject, and the colours of many
    do not speak against it.

    Empty if what they allow does not meet."""


def masks_from_backgrounds(
    images: Mapping[int, UInt8[np.ndarray, "_h _w 3"]],
    backgrounds: Mapping[int, UInt8[np.ndarray, "_h _w 3"]],
    known: Mapping[int, Mask],
    cameras: Mapping[int, Camera],
    up: Float[np.ndarray, "3"],
    unknown: Mapping[int, Mask] | None = None,
    calm: Mapping[int, Mask] | None = None,
    decide: bool = True,
    learnt: Collection[int] = (),
) -> FoundMasks:
    """Masks of the cameras that have a picture of the empty scene.

    What differs from the background in colour is the subject; what is only darker may be its shadow, and is the subject
    where the other cameras' changed regions meet above the floor. OpenCV's grabCut then finds the outline.

    Args:
        images: the subject, by camera.
        backgrounds: the empty scene, for the cameras whose masks are wanted.
        known: masks of other cameras, which help.
        cameras: all of these cameras.
        up: the world's vertical.
        unknown: where the empty scene is not known, by camera at any size; None: it is known everywhere.
        calm: where its colour never varies, by camera at the pictures' size; None: nowhere.
        decide: whether colours and the other cameras decide there; else it is in no mask.
        learnt: the cameras whose empty scene was learnt from the clip.
    """
    compare = lambda k: background_difference(images[k], backgrounds[k], (unknown or {}).get(k), k in learnt)
    compared = dict(zip(backgrounds, in_threads(compare, backgrounds), strict=True))
    given = {k: (cv2.resize(images[k], working_size(*mask.shape[::-1])), mask) for k, mask in known.items()}
    decided = _decided(compared, calm or {}, given, cameras, up) if decide else {}
    differences = compared | {k: _with_subject(compared[k], told) for k, told in decided.items()}
    guesses = {camera: first_guess(difference) for camera, difference in differences.items()}
    guesses = {camera: guess for camera, guess in guesses.items() if is_subject(guess)}
    possible = {c: compared[c].open | guess for c, guess in guesses.items()}
    better, hull = _seen_together(differences, guesses, possible, known, cameras, up)
    told = lambda camera, mask: mask if decide else mask & ~differences[camera].unknown
    guesses = {c: told(c, mask) for c, mask in (guesses | better).items()}
    guesses = {c: mask for c, mask in guesses.items() if is_subject(mask)}
    cut = lambda c: told(c, cut_out(differences[c], guesses[c], hull.get(c) if decide else None))
    cuts = in_threads(cut, guesses)
    sized = {camera: _enlarged(mask, images[camera]) for camera, mask in zip(guesses, cuts, strict=True)}
    possible = {k: decided[k].possible if k in decided else compared[k].unknown for k in hull}
    by_colors = {c: _enlarged(mask & possible[c], images[c]) for c, mask in hull.items()}
    return FoundMasks({camera: mask for camera, mask in sized.items() if is_subject(mask)}, by_colors)


def first_guess(difference: Difference) -> Bool[np.ndarray, "rows columns"]:
    """The subject as one camera alone shows it: what differs in colour, and changed places enclosed by it."""
    different = closed(difference.different, 5)
    return largest_parts(different | (without_holes(different) & difference.changed))


def _decided(
    differences: Mapping[int, Difference],
    calm: Mapping[int, Mask],
    given: Mapping[int, tuple[UInt8[np.ndarray, "_h _w 3"], Mask]],
    cameras: Mapping[int, Camera],
    up: Float[np.ndarray, "3"],
) -> dict[int, Decided]:
    """What colours tell of the cameras for which something is unknown; nothing where they tell nothing.

    `given` are pictures and masks of other cameras.
    """
    guesses = {k: first_guess(difference) for k, difference in differences.items()}
    unsure = [k for k, difference in differences.items() if difference.unknown.any()]
    if not unsure:
        return {}
    masks = guesses | {k: reduced_mask(mask) for k, (_, mask) in given.items()}
    nothing = {k: np.zeros_like(mask) for k, mask in masks.items()}
    scene = Scene(
        {k: difference.image for k, difference in differences.items()} | {k: image for k, (image, _) in given.items()},
        masks,
        nothing | {k: difference.unknown for k, difference in differences.items()},
        nothing | {k: reduced_mask(calm[k]) for k in guesses if k in calm},
    )
    small = {k: resized(cameras[k], mask.shape[::-1]) for k, mask in masks.items()}
    told = decided_together(scene, small, up)
    return {} if told is None else {k: told[k] for k in unsure}


def _with_subject(difference: Difference, told: Decided) -> Difference:
    """The difference, in which the subject is different, and less is unknown."""
    decided = difference.unknown & ~told.untold
    put = lambda before: np.where(decided, np.where(told.subject, 2.0 * CERTAIN, 0.0), before)
    return replace(
        difference,
        change=put(difference.change),
        unexplained=put(difference.unexplained),
        changed=np.where(decided, told.subject, difference.changed),
        different=difference.different | told.subject,
        unknown=told.untold,
    )


def cut_out(difference: Difference, guess: Mask, hull: Mask | None = None) -> Mask:
    """A guess with its outline corrected by OpenCV's grabCut, in the box around it.

    What is unknown in the silhouette of the other cameras' `hull` is left to grabCut, too: shoes that never left the
    floor are as unknown as it, and only their colours tell them from it.
    """
    unknown = np.zeros_like(guess) if hull is None else difference.unknown & hull
    box = _box_around(guess | unknown)
    labels = _labels(guess[box], difference.change[box], difference.unexplained[box], unknown[box])
    cut = np.zeros_like(guess)
    cut[box] = largest_parts(_grab_cut(difference.image[box], labels))
    return cut


def _box_around(mask: Mask) -> tuple[slice, slice]:
    """The part of a picture that holds a mask, with some of what is around it."""
    rows, columns = np.nonzero(mask)
    border = 12 + int(0.08 * max(np.ptp(rows), np.ptp(columns)))
    return (
        slice(max(rows.min() - border, 0), rows.max() + border),
        slice(max(columns.min() - border, 0), columns.max() + border),
    )


def _grab_cut(picture: UInt8[np.ndarray, "_h _w 3"], labels: UInt8[np.ndarray, "_h _w"]) -> Mask:
    """The subject by OpenCV's grabCut, which needs both: a box without background is one that the subject fills."""
    subject = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD))
    if subject.all() or not subject.any():
        return subject
    cv2.setRNGSeed(0)  # its clusters start at random; a mask must not change from run to run
    crop, labels, model = np.ascontiguousarray(picture), labels.copy(), lambda: np.zeros((1, 65))
    cv2.grabCut(crop, labels, (0, 0, 1, 1), model(), model(), GRAB_CUT_ITERATIONS, cv2.GC_INIT_WITH_MASK)
    return np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD))


def unlike_the_room(picture: UInt8[np.ndarray, "_h _w 3"], unknown: Mask) -> Mask:
    """What is unlike the room around it where the background is unknown, by OpenCV's grabCut."""
    scale = min(COARSE_SIDE / max(unknown.shape), 1.0)
    size = (round(scale * unknown.shape[1]), round(scale * unknown.shape[0]))
    small = cv2.resize(unknown.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    labels = np.where(small, cv2.GC_PR_FGD, cv2.GC_BGD).astype(np.uint8)
    cut = _grab_cut(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), labels)
    return (cv2.resize(cut.astype(np.uint8), unknown.shape[::-1], interpolation=cv2.INTER_NEAREST) > 0) & unknown


def largest_parts(mask: Bool[np.ndarray, "rows columns"]) -> Bool[np.ndarray, "rows columns"]:
    """The mask without small separate parts."""
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=8)
    if count < 2:
        return mask
    areas = stats[1:, cv2.CC_STAT_AREA]
    return np.isin(labels, np.flatnonzero(areas >= SMALLEST_PART * areas.max()) + 1)


def _labels(guess: Mask, change: np.ndarray, unexplained: np.ndarray, unknown: Mask) -> UInt8[np.ndarray, "_h _w"]:
    """What grabCut may change: pixels near the guess's outline that the difference leaves open, and unknown ones."""
    inside, around = guess.astype(np.uint8), widened(guess, 4) | unknown
    labels = np.where(guess, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    labels[(cv2.erode(inside, disc(5)) > 0) & (unexplained > CERTAIN)] = cv2.GC_FGD
    labels[~around | ((change < UNCHANGED) & ~guess)] = cv2.GC_BGD
    return labels


def _seen_together(
    differences: Mapping[int, Difference],
    guesses: Mapping[int, Mask],
    possible: Mapping[int, Mask],
    known: Mapping[int, Mask],
    cameras: Mapping[int, Camera],
    up: Float[np.ndarray, "3"],
) -> tuple[dict[int, Mask], dict[int, Mask]]:
    """Better guesses from all cameras together, and their hull's silhouettes; empty if their regions do not meet.

    The subject is nowhere but where it is `possible`: what colours decide may be a table in front.
    """
    small_known = {camera: reduced_mask(mask) for camera, mask in known.items()}
    subjects = {**guesses, **small_known}
    if len(subjects) < 2 or not guesses:
        return {}, {}
    regions = {**small_known, **possible}
    small = {c: resized(cameras[c], (mask.shape[1], mask.shape[0])) for c, mask in subjects.items()}
    cube = cube_around([largest_parts(regions[c]) for c in subjects], [small[c] for c in subjects])
    pixels = {c: voxel_pixels(cube, small[c], mask.shape) for c, mask in subjects.items()}
    misses = np.sum([~pixels[c].hits(widened(region, 1)) for c, region in regions.items()], axis=0)
    hull = misses <= (1 if len(subjects) >= MANY else 0)
    above_floor = without_floor(hull, up)
    better = {c: _confirmed(differences[c], pixels[c], hull, above_floor) for c in guesses}
    silhouettes = {c: pixels[c].silhouette_of(hull) for c in guesses}
    return {c: guess for c, guess in better.items() if is_subject(guess)}, silhouettes


def _confirmed(difference: Difference, pixels: VoxelPixels, hull: np.ndarray, above_floor: np.ndarray) -> Mask:
    """Different colours near the hull, and all changes where it stands above the floor."""
    stands = pixels.silhouette_of(above_floor)
    low = pixels.footprint * LOW_VOXELS  # feet are as near as this to what stands, the rim of a shadow seldom is
    away = cv2.distanceTransform((~stands).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    near = widened(pixels.silhouette_of(hull), pixels.footprint) & (away <= low)
    different = closed(difference.different & near, 5) & difference.changed
    return largest_parts(different | (difference.changed & stands))


def is_subject(mask: Mask) -> bool:
    """Whether a region is neither almost nothing nor most of the picture."""
    return SMALLEST_SHARE < float(mask.mean()) < LARGEST_SHARE


def _enlarged(mask: Mask, image: UInt8[np.ndarray, "_h _w 3"]) -> Mask:
    size = (image.shape[1], image.shape[0])
    return cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_LINEAR) > 0.5
