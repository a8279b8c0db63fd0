"""Where the subject may be hidden in the pictures of a clip: the part of the room in which something moves.

A pixel that never changes shows the wall, or somebody who stands still: its colour alone cannot tell. Two things do.
What is enclosed by movement may be the subject in every camera. And where the movement is carved out of space by all
cameras together, somebody may have stood all the time, below or beside what moves: legs that stand still while the
trunk bends over them. There, no pixel that never changes counts as background. If what moves is not as high as a body,
the subject may only wave its arms, and trunk and legs stand farther from them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float

from sogjax.model.camera import Camera
from sogjax.scene.background_difference import closed, disc, without_holes
from sogjax.scene.visual_hull import MANY, Cube, cube_around, from_upright, resized, upright, voxel_pixels

SMALLEST_ROOM = 2.6
"""Metres: the cube of space that is looked at is at least so large."""
WHOLE_BODY = 1.6
"""Metres: what moves over less height than this may be only a part of a body. (Lifted arms alone: up to 1.5 m.)"""
REACH, NEAR = 0.6, 0.25
"""Metres on the floor from what moves to what belongs to it and stands still: from a part of a body, from a trunk."""
CORE = 0.5
"""Of what is as high as a body, a trunk is where it moves over this part of the greatest height."""
TALLEST = 2.1
"""Metres from the highest moving place down to the floor, or up from the lowest, in that case."""
SEEING = 0.7
"""Share of the cameras that must have a place in their pictures."""

Mask = Bool[np.ndarray, "_h _w"]


def moving_zones(
    movements: Sequence[Mapping[int, Mask]], cameras: Mapping[int, Camera], up: Float[np.ndarray, "3"]
) -> dict[int, Mask]:
    """The zone in each camera's picture, from where things move in it during a few spans of the clip.

    `movements` are masks by camera for every span; `up` is the world's vertical.
    """
    anywhere = {camera: np.any([span[camera] for span in movements], axis=0) for camera in movements[0]}
    zones = {camera: filled(mask) for camera, mask in anywhere.items()}
    seeing = [camera for camera, mask in anywhere.items() if mask.any()]
    if len(seeing) < 2:
        return zones
    small = {c: resized(cameras[c], (anywhere[c].shape[1], anywhere[c].shape[0])) for c in seeing}
    found = cube_around([anywhere[c] for c in seeing], [small[c] for c in seeing])
    cube = Cube(found.centre, max(found.size, SMALLEST_ROOM))
    pixels = {c: voxel_pixels(cube, small[c], anywhere[c].shape) for c in seeing}
    spans = [_carved([pixels[c].hits(_widened(span[c], pixels[c].footprint)) for c in seeing]) for span in movements]
    seen = np.sum([pixels[c].inside for c in seeing], axis=0) >= SEEING * len(seeing)
    hidden = {
        c: anywhere[c] | pixels[c].silhouette_of(seen & unseen)
        for c, unseen in zip(seeing, _by_others(spans), strict=True)
    }
    moving = [upright(span.hull & seen, up) for span in spans]
    blocks = [block for block in moving if block.any()]
    if blocks:
        whole = moving_height(np.any(blocks, axis=0)) * cube.spacing >= WHOLE_BODY
        reach, core = (NEAR, CORE) if whole else (REACH, 0.0)
        rooms = _standing(blocks if whole else moving, cube.spacing, reach, core)
        standing = from_upright(np.all(rooms, axis=0) if whole else _early_and_late(np.stack(rooms)), up)
        hidden = {c: mask | pixels[c].silhouette_of(standing) for c, mask in hidden.items()}
    return zones | {c: filled(mask) for c, mask in hidden.items()}


@dataclass(frozen=True)
class _Carved:
    """Where something moves in space, as far as the cameras tell."""

    hull: Bool[np.ndarray, "voxel"]
    """All cameras together, of many all but one."""
    without: tuple[Bool[np.ndarray, "voxel"], ...]
    """The hull of many cameras without each of them in turn; nothing where they are few."""


def _carved(hits: Sequence[Bool[np.ndarray, "voxel"]]) -> _Carved:
    misses = np.sum([~hit for hit in hits], axis=0)
    if len(hits) < MANY:
        return _Carved(misses == 0, tuple(np.zeros_like(hit) for hit in hits))
    return _Carved(misses <= 1, tuple(misses - ~hit <= 1 for hit in hits))


def _by_others(spans: Sequence[_Carved]) -> list[Bool[np.ndarray, "voxel"]]:
    """Where all cameras but one see something move during some span: it may come straight towards that one."""
    return [np.any(of_one, axis=0) for of_one in zip(*(span.without for span in spans), strict=True)]


def filled(mask: Mask) -> Mask:
    """The mask without small gaps, and with what it encloses."""
    joined = closed(mask, 2 * max(round(0.012 * max(mask.shape)), 1) + 1) | mask
    return without_holes(joined)


def _widened(mask: Mask, footprint: int) -> Mask:
    return cv2.dilate(mask.astype(np.uint8), np.ones((footprint + 1, footprint + 1), np.uint8)) > 0


def moving_height(moving: Bool[np.ndarray, "x y z"]) -> int:
    """The longest run of heights, in voxels, at each of which something moves."""
    longest = run = 0
    for level in np.any(moving, axis=(0, 1)):
        run = run + 1 if level else 0
        longest = max(longest, run)
    return longest


def _standing(
    spans: Sequence[Bool[np.ndarray, "x y z"]], spacing: float, reach: float, core: float
) -> list[Bool[np.ndarray, "x y z"]]:
    """Upright pillars as high as a body in each span, around the convex outline of what moves, seen from above."""
    low, high = np.percentile(np.nonzero(np.any(spans, axis=0))[2], [2, 99])
    height = slice(max(round(high - TALLEST / spacing), 0), round(low + TALLEST / spacing))
    rooms = []
    for block in spans:
        room = np.zeros_like(block)
        heights = block.sum(axis=2)
        room[convex((heights > 0) & (heights >= core * heights.max()), reach / spacing), height] = True
        rooms.append(room)
    return rooms


def _early_and_late(rooms: Bool[np.ndarray, "span x y z"]) -> Bool[np.ndarray, "x y z"]:
    """What is near something that moves early and late, half of the clip apart: who only waves pauses, too."""
    first, last = rooms.argmax(axis=0), len(rooms) - 1 - rooms[::-1].argmax(axis=0)
    return rooms.any(axis=0) & (last - first >= len(rooms) // 2)


def convex(plan: Bool[np.ndarray, "x y"], border: float) -> Bool[np.ndarray, "x y"]:
    """Every part of a plan made convex, with a border."""
    outlines, _ = cv2.findContours(plan.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    canvas = np.zeros(plan.shape, np.uint8)
    for outline in outlines:
        cv2.fillConvexPoly(canvas, cv2.convexHull(outline), 1)
    return cv2.dilate(canvas, disc(2 * round(border) + 1)) > 0
