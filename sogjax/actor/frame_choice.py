"""Which frames of a clip serve as example poses: somebody whole, limbs clear of the trunk, in different shapes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import center_of_mass, label

from sogjax.model.camera import Camera
from sogjax.scene.segmentation import is_subject, largest_parts
from sogjax.scene.visual_hull import MANY, VOXELS, Cube, VoxelPixels, cube_around, voxel_pixels

SMALLEST_BODY = 0.1
"""Volume of a separate part of a hull, as a share of the largest, from which on it may be somebody else."""
LEAST_PARTS, LEAST_BESIDE = 0.5, 0.25
"""Least share of the cameras that must show the subject; somebody beside others, who hide him from the rest."""
FRAMES_AT_ONCE = 4
"""Whose hulls are carved at the same time: each takes some 55 MB with twelve cameras."""
SHAPE_VOXELS = 16
"""Voxels along each side of the cube in which shapes are compared."""

Mask = Bool[np.ndarray, "rows columns"]


@dataclass(frozen=True)
class SeenShape:
    """What the silhouettes of one frame tell of it."""

    frame: int
    num_bodies: int
    """Separate parts of the hull that are as large as a body."""
    whole: float
    """Share of the cameras that show all of the subject."""
    agreement: float
    """How well hull and silhouettes agree (intersection over union, mean over cameras)."""
    clear: float
    """Share of the silhouettes' convex hulls that is empty: limbs that are held away from the body."""
    height: float
    """Vertical extent of the hull, metres."""
    known: float
    """Part of the silhouettes of the hull where the background is known."""
    voxels: Bool[np.ndarray, "x y z"]
    """The hull about its centre, coarsely, in a cube of a size that all frames share."""

    @property
    def worth(self) -> float:
        """How well the frame serves: somebody upright is easiest to read."""
        return self.height**2 * self.agreement**2 * self.whole * self.known * (0.1 + self.clear) / self.num_bodies


def subject_cubes(
    masks: Sequence[Mapping[int, Mask]], cameras: Mapping[int, Camera], least: float = LEAST_PARTS
) -> list[Cube | None]:
    """A cube around the subject in each frame, all of one size; None where too few cameras show one."""
    cubes: list[Cube | None] = []
    for seen in masks:
        shown = {k: mask for k, mask in seen.items() if is_subject(mask)}
        enough = len(shown) >= max(2, least * len(cameras))
        cubes.append(
            cube_around([largest_parts(m) for m in shown.values()], [cameras[k] for k in shown]) if enough else None
        )
    sizes = [cube.size for cube in cubes if cube is not None]
    size = float(np.percentile(sizes, 75)) if sizes else 0.0
    return [None if cube is None else Cube(cube.centre, size) for cube in cubes]


def seen_shape(
    frame: int,
    masks: Mapping[int, Mask],
    unknown: Mapping[int, Mask],
    cameras: Mapping[int, Camera],
    cube: Cube,
    up: Float[np.ndarray, "3"],
    least_shown: float = 0.0,
    misses: int = 0,
) -> SeenShape | None:
    """What the silhouettes of one frame tell; None if they do not meet anywhere.

    The hull is what this share of the masks show at least: furniture that no camera knows the room behind is in none.
    So many masks more than usual may lack a part of it.

    By camera, `masks` say what is not the background and `unknown` where nothing is known of it; the cameras are those
    of pictures of the masks' size. The subject is in the cube.
    """
    pixels = {k: voxel_pixels(cube, cameras[k], mask.shape) for k, mask in masks.items()}
    seen = np.sum([pixels[k].shows(widened(mask)) for k, mask in masks.items()], axis=0) >= least_shown * len(masks)
    connected: Any = label((hull_within(masks, unknown, pixels, misses) & seen).reshape(VOXELS, VOXELS, VOXELS))
    labels, count = connected
    volumes = np.bincount(labels.ravel())[1:]
    if not count:
        return None
    body = labels == _part_shown(labels, volumes, masks, pixels)
    silhouettes = {k: pixels[k].silhouette_of(body.ravel()) for k in masks}
    return SeenShape(
        frame=frame,
        num_bodies=int(np.sum(volumes > SMALLEST_BODY * volumes.max())),
        whole=float(np.mean([_whole(silhouette) for silhouette in silhouettes.values()])),
        agreement=float(np.mean([_agreement(masks[k], unknown[k], silhouettes[k]) for k in masks])),
        clear=float(np.mean([_empty_share(silhouette) for silhouette in silhouettes.values()])),
        height=float(np.ptp(np.nonzero(body)[int(np.argmax(np.abs(up)))]) + 1) * cube.spacing,
        known=float(np.mean([_known_share(unknown[k], silhouettes[k]) for k in masks])),
        voxels=_about_centre(body),
    )


def hull_within(
    masks: Mapping[int, Mask], unknown: Mapping[int, Mask], pixels: Mapping[int, VoxelPixels], more: int = 0
) -> Bool[np.ndarray, "voxel"]:
    """The voxels that (almost) no camera rules out, of those in enough pictures: beside a picture all is allowed.

    Of many cameras one may, and so many `more`.
    """
    ruling_out = np.sum([~pixels[k].hits(widened(mask | unknown[k])) for k, mask in masks.items()], axis=0)
    shown = np.sum([pixels[k].inside for k in masks], axis=0)
    return (ruling_out <= (1 + more if len(masks) >= MANY else 0)) & (shown >= max(2, LEAST_PARTS * len(masks)))


def _part_shown(
    labels: Int[np.ndarray, "x y z"],
    volumes: Int[np.ndarray, "part"],
    masks: Mapping[int, Mask],
    pixels: Mapping[int, VoxelPixels],
) -> int:
    """The label of the part of a hull that covers most of the masks; what no camera shows apart may be larger."""
    large = (np.flatnonzero(volumes > SMALLEST_BODY * volumes.max()) + 1).tolist()
    covered = lambda part: sum(int((pixels[k].silhouette_of(part) & mask).sum()) for k, mask in masks.items())
    return large[0] if len(large) == 1 else max(large, key=lambda number: covered((labels == number).ravel()))


def spread_choice(shapes: Sequence[SeenShape], count: int) -> list[SeenShape]:
    """The best frame, then one after the other the one that serves best and is least like those before."""
    return [shape for (shape,) in spread_moments([(shape,) for shape in shapes], count)]


def spread_moments(moments: Sequence[tuple[SeenShape, ...]], count: int) -> list[tuple[SeenShape, ...]]:
    """Moments of several people, the best of them unlike each other; all count, and their shapes are in one order."""
    worth = lambda moment: float(np.prod([shape.worth for shape in moment]))
    unlike = lambda one, other: float(np.mean([unlikeness(a, b) for a, b in zip(one, other, strict=True)]))
    left = sorted(moments, key=lambda moment: -worth(moment))
    chosen: list[tuple[SeenShape, ...]] = []
    while left and len(chosen) < count:
        novelty = [min((unlike(moment, other) for other in chosen), default=1.0) for moment in left]
        best = int(np.argmax([worth(moment) * new for moment, new in zip(left, novelty, strict=True)]))
        chosen.append(left.pop(best))
    return sorted(chosen, key=lambda moment: moment[0].frame)


def unlikeness(one: SeenShape, other: SeenShape) -> float:
    """From 0 to 1: how little two hulls overlap when their centres are at one place."""
    return 1.0 - float((one.voxels & other.voxels).sum() / max((one.voxels | other.voxels).sum(), 1))


def widened(mask: Mask) -> Mask:
    """The mask and the cells beside it."""
    return cv2.dilate(mask.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0


def _whole(silhouette: Mask) -> bool:
    return not (silhouette[0].any() or silhouette[-1].any() or silhouette[:, 0].any() or silhouette[:, -1].any())


def _agreement(mask: Mask, unknown: Mask, silhouette: Mask) -> float:
    told = ~unknown
    return float((mask & silhouette & told).sum() / max(((mask | silhouette) & told).sum(), 1))


def _known_share(unknown: Mask, silhouette: Mask) -> float:
    return 1.0 - float((silhouette & unknown).sum() / max(silhouette.sum(), 1))


def _empty_share(silhouette: Mask) -> float:
    points = np.argwhere(silhouette)[:, ::-1].astype(np.int32)
    if len(points) < 3:
        return 0.0
    canvas = np.zeros(silhouette.shape, np.uint8)
    cv2.fillConvexPoly(canvas, cv2.convexHull(points), 1)
    return 1.0 - float(len(points) / max(canvas.sum(), 1))


def _about_centre(body: Bool[np.ndarray, "x y z"]) -> Bool[np.ndarray, "u v w"]:
    """The body moved to the middle of the cube, in larger voxels."""
    middle: Int[np.ndarray, 3] = np.rint(np.array(body.shape) / 2 - np.array(center_of_mass(body))).astype(int)
    moved = np.roll(body, tuple(middle), axis=(0, 1, 2))
    part = VOXELS // SHAPE_VOXELS
    blocks = moved.reshape(SHAPE_VOXELS, part, SHAPE_VOXELS, part, SHAPE_VOXELS, part)
    return blocks.mean(axis=(1, 3, 5)) > 0.3
