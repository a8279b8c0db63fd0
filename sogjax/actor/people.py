"""Several people in one frame: parts of the visual hull that stand apart, and where each camera shows which.

Who is who, among people that are seen apart in several frames: by their places, and by their colours.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8
from scipy.ndimage import binary_dilation, distance_transform_edt, gaussian_filter, label
from scipy.optimize import linear_sum_assignment

from sogjax.actor.frame_choice import SMALLEST_BODY, Mask, hull_within
from sogjax.actor.touching_people import cut_apart
from sogjax.model.camera import Camera
from sogjax.scene.visual_hull import VOXELS, Cube, VoxelPixels, voxel_pixels, without_floor

GAP = 0.25
"""Vertical gap between the parts of one body that is closed, metres: a belt in the background's colours."""
LEAST_HEIGHT = 0.4
"""Height of a part of the hull, as a share of the tallest one's, from which on it may be somebody else."""
PIECE, NEAR = 0.35, 0.35
"""A part of less than this share of another one's volume, and no farther from it than this (metres), is a piece of it:
a forearm or a foot whose joint the background's colours hide. People who stand so near each other are seldom apart."""
ALONE = 0.15
"""Share of somebody's silhouettes, all cameras together, that is nobody else's."""
HIDDEN, TOUCHED = 0.1, 0.35
"""Share of a silhouette that is also another one's, above which a camera's mask is not used; of people who touch."""
COLOR_BINS = 6
"""Bins of each channel in the histogram of somebody's colours."""


@dataclass(frozen=True)
class PersonSeen:
    """One of several people in one frame; everything by camera is in cells."""

    frame: int
    place: Float[np.ndarray, "3"]
    """Centre of the part of the hull, metres, world."""
    regions: dict[int, Mask]
    """Where each camera shows nobody else: the silhouette, a little widened. A camera in which another one hides the
    person, or is hidden by him, is absent."""
    others: dict[int, Mask]
    """Where each of these cameras shows others who are seen apart there; the rest may be behind somebody."""
    masks: dict[int, Mask]
    """What is not the background in the person's regions."""
    colors: Float[np.ndarray, "bin"]
    """Share of each colour, all cameras together."""


def people_apart(
    frame: int,
    masks: Mapping[int, Mask],
    unknown: Mapping[int, Mask],
    pictures: Mapping[int, UInt8[np.ndarray, "rows columns 3"]],
    cameras: Mapping[int, Camera],
    cube: Cube,
    up: Float[np.ndarray, "3"],
    count: int = 0,
) -> list[PersonSeen]:
    """The people who stand apart from each other in one frame, in no particular order.

    By camera, `masks` say what is not the background, shadows or not, `unknown` where nothing is known of it, and
    `pictures` are the cells' colours; the cameras are those of pictures of that size. All people are in the cube. Where
    fewer than `count` stand apart, those who touch are cut apart, if they look like so many.
    """
    pixels = {k: voxel_pixels(cube, cameras[k], mask.shape) for k, mask in masks.items()}
    hull = without_floor(hull_within(masks, unknown, pixels), up)
    parts = _bodies(hull.reshape(3 * (VOXELS,)), cube.spacing, int(np.argmax(np.abs(up))))
    bodies = _needed(parts, masks, pixels)
    most = HIDDEN
    if len(bodies) < count:
        bodies, most = cut_apart(bodies, count, cube.spacing, up), TOUCHED
    places = [cube.middle(body) for body in bodies]
    regions = {
        k: _regions([pixels[k].silhouette_of(body) for body in bodies], _depths(places, cameras[k]), pixels[k])
        for k in masks
    }
    people = []
    for number, place in enumerate(places):
        own = {k: of_camera[number].around for k, of_camera in regions.items() if of_camera[number].hidden <= most}
        apart = {k: [one for j, one in enumerate(regions[k]) if j != number and one.hidden <= most] for k in own}
        others = {k: np.any([np.zeros_like(own[k]), *(one.around for one in apart[k])], axis=0) for k in own}
        limited = {k: masks[k] & region for k, region in own.items()}
        people.append(PersonSeen(frame, place, own, others, limited, color_histogram(pictures, limited)))
    return people


def color_histogram(
    pictures: Mapping[int, UInt8[np.ndarray, "_rows _columns 3"]],
    masks: Mapping[int, Bool[np.ndarray, "_rows _columns"]],
) -> Float[np.ndarray, "bin"]:
    """The share of each colour in the masks of all cameras, a little blurred; zeros where they are empty."""
    total = np.zeros(3 * (COLOR_BINS,))
    for k, mask in masks.items():
        bins = (pictures[k][mask].astype(int) * COLOR_BINS) >> 8
        np.add.at(total, tuple(bins.T), 1.0)
    return (gaussian_filter(total, 0.6) / max(total.sum(), 1.0)).ravel()


def _bodies(hull: Bool[np.ndarray, "x y z"], spacing: float, axis: int) -> list[Bool[np.ndarray, "voxel"]]:
    """The separate parts of a hull that are as tall and as large as somebody."""
    structure = np.ones([2 * round(0.5 * GAP / spacing) + 1 if k == axis else 1 for k in range(3)], bool)
    connected: Any = label(binary_dilation(hull, structure))
    labels: Int[np.ndarray, "x y z"] = np.where(hull, connected[0], 0)
    parts = [labels == number for number in range(1, connected[1] + 1)]
    volumes = [int(part.sum()) for part in parts]
    heights = [int(np.ptp(np.nonzero(part)[axis])) if part.any() else 0 for part in parts]
    large = [
        part
        for part, volume, height in zip(parts, volumes, heights, strict=True)
        if volume > SMALLEST_BODY * max(volumes) and height > LEAST_HEIGHT * max(heights)
    ]
    return [body.ravel() for body in _pieces_joined(large, spacing)]


def _needed(
    parts: Sequence[Bool[np.ndarray, "voxel"]], masks: Mapping[int, Mask], pixels: Mapping[int, VoxelPixels]
) -> list[Bool[np.ndarray, "voxel"]]:
    """The parts without which something in the masks would be nobody's, in their order.

    Where the silhouettes of two people meet, the hull has more parts: all cameras allow somebody there, and none shows
    him apart from the others.
    """
    shown = [{k: pixels[k].silhouette_of(part) & mask for k, mask in masks.items()} for part in parts]
    kept = list(range(len(parts)))
    for number in np.argsort([int(part.sum()) for part in parts]).tolist():
        others = [shown[k] for k in kept if k != number]
        if not others:
            break
        alone = sum(
            int((mask & ~np.any([one[k] for one in others], axis=0)).sum()) for k, mask in shown[number].items()
        )
        if alone < ALONE * sum(int(mask.sum()) for mask in shown[number].values()):
            kept.remove(number)
    return [parts[k] for k in kept]


def _pieces_joined(parts: list[Bool[np.ndarray, "x y z"]], spacing: float) -> list[Bool[np.ndarray, "x y z"]]:
    """The parts that are no pieces of another one, in their order, with their pieces."""
    volumes, bodies = [int(part.sum()) for part in parts], dict(enumerate(parts))
    for k in np.argsort(volumes).tolist():
        for j in [j for j in bodies if volumes[k] < PIECE * volumes[j]]:
            away: Any = distance_transform_edt(~parts[j])
            if away[parts[k]].min() * spacing <= NEAR:
                bodies[j] = bodies[j] | bodies.pop(k)
                break
    return list(bodies.values())


def _depths(places: Sequence[Float[np.ndarray, "3"]], camera: Camera) -> list[float]:
    """The depth of places in a camera's picture, metres."""
    pose = np.asarray(camera.camera_from_world, float)
    return [float(pose[2, :3] @ place + pose[2, 3]) for place in places]


class _Region(NamedTuple):
    """Where one camera shows one of several people."""

    around: Mask
    """What is nearer to the silhouette than to the others, and not far from it."""
    hidden: float
    """Share of the silhouette that is also another one's; infinite where there is none."""


def _regions(silhouettes: Sequence[Mask], away: Sequence[float], pixels: VoxelPixels) -> list[_Region]:
    """What one camera shows of each of some people; two silhouettes' cells belong to who is nearer (`away`, metres)."""
    width = 2 * pixels.footprint + 2
    distances = [cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, 3) for mask in silhouettes]
    ranked = [distance + 1e-3 * rank for distance, rank in zip(distances, np.argsort(np.argsort(away)), strict=True)]
    regions: list[_Region] = []
    for number, (mask, distance) in enumerate(zip(silhouettes, distances, strict=True)):
        others = [k for k in range(len(distances)) if k != number]
        nearest = np.min([distances[k] for k in others], axis=0) if others else np.full(mask.shape, np.inf)
        own = np.all([ranked[number] < ranked[k] for k in others], axis=0)
        hidden = float((mask & (nearest <= 1.0)).sum() / mask.sum()) if mask.any() else np.inf
        regions.append(_Region((distance <= width) & own & mask.any(), hidden))
    return regions


FASTEST = 4.0
"""Metres per second: people who stand farther apart than this brings one until the next frame cannot change places."""
MOVED = 0.5
"""Largest way from frame to frame, as a share of the distance between two people, for places to tell them."""
SURE = 0.2
"""Least difference that exchanging two people makes to how far their colours are off (from 0 to 2), to tell them."""

Moment = Sequence[PersonSeen]
"""The people in one frame, as many in each."""


def told_apart(moments: Sequence[Moment], fps: float) -> list[list[PersonSeen]]:
    """The moments (in the order of the clip) in which it is sure who is who, people in the same order in all of them.

    Within a run of moments, places tell; runs are brought together by the colours, the longest first.
    """
    runs = runs_by_place(moments, fps)
    if not runs:
        return []
    told: list[list[PersonSeen]] = []
    for run in sorted(runs, key=len, reverse=True):
        colors = [_mean_colors(run, k) for k in range(len(run[0]))]
        order = list(range(len(colors)))
        if told:
            known = [_mean_colors(told, k) for k in order]
            order, margin = matched(np.array([[unlike(a, b) for b in colors] for a in known]))
            if margin < SURE:
                continue
        told += [[moment[k] for k in order] for moment in run]
    return sorted(told, key=lambda moment: moment[0].frame)


def runs_by_place(moments: Sequence[Moment], fps: float) -> list[list[list[PersonSeen]]]:
    """Moments that follow each other so fast that nobody can have changed places, people in one order in each run."""
    runs: list[list[list[PersonSeen]]] = []
    for moment in moments:
        last = runs[-1][-1] if runs else None
        ways = None if last is None else _distances(last, moment)
        if last is not None and ways is not None:
            order, _ = matched(ways)
            apart = min(_nearest(last), _nearest(moment))
            moved = max(float(ways[k, other]) for k, other in enumerate(order))
            seconds = (moment[0].frame - last[0].frame) / fps
            if moved < MOVED * apart and FASTEST * seconds < apart:
                runs[-1].append([moment[k] for k in order])
                continue
        runs.append([list(moment)])
    return runs


def matched(costs: Float[np.ndarray, "known found"]) -> tuple[list[int], float]:
    """Which one found is each one known, at the least cost, and what exchanging two of them would cost more."""
    order = linear_sum_assignment(costs)[1].tolist()
    pairs = [(i, j) for i in range(len(order)) for j in range(i)]
    exchanged = [costs[i, order[j]] + costs[j, order[i]] - costs[i, order[i]] - costs[j, order[j]] for i, j in pairs]
    return order, float(min(exchanged, default=np.inf))


def unlike(one: Float[np.ndarray, "bin"], other: Float[np.ndarray, "bin"]) -> float:
    """From 0 to 1: how little two histograms of colours have in common."""
    return 1.0 - float(np.minimum(one, other).sum())


def _mean_colors(moments: Sequence[Moment], person: int) -> Float[np.ndarray, "bin"]:
    return np.mean([moment[person].colors for moment in moments], axis=0)


def _distances(one: Moment, other: Moment) -> Float[np.ndarray, "one other"]:
    return np.array([[np.linalg.norm(a.place - b.place) for b in other] for a in one])


def _nearest(moment: Moment) -> float:
    """The distance of the two that are nearest to each other, metres."""
    distances = _distances(moment, moment)
    return float(np.min(distances[~np.eye(len(moment), dtype=bool)], initial=np.inf))
