"""Whether the silhouettes of all cameras show one thing: each is compared with the visual hull of the others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from jaxtyping import Bool

from sogjax.check.silhouettes import Moment
from sogjax.io.calibration.rig import CameraRig
from sogjax.scene.visual_hull import (
    AGREEING,
    OWN_COVERAGE,
    Cube,
    VoxelPixels,
    cube_around,
    resized,
    voxel_pixels,
    widened_by_half_a_voxel,
)

FEWEST_VIEWS = 3
"""With two silhouettes that disagree, nothing tells which is wrong."""
AWAY = 0.75
"""Degrees that a silhouette may be from where the others put the subject: masks are rough, and so are calibrations."""
TURNED = 4.0
"""Degrees by which it may be turned in the picture."""
ELONGATED = 2.5
"""Length over width above which a silhouette shows how it is turned."""
TIGHT = 1.5
"""The others' hull must not be larger than this, in areas of the silhouette, to show how it is turned."""
COARSER = 2
"""Pixels of the masks, for the search of a shift."""
ROUGHNESS = 0.03
"""Share of a silhouette that its outline's errors may take from an overlap."""

Mask = Bool[np.ndarray, "_h _w"]


@dataclass(frozen=True)
class Misfit:
    """How a silhouette differs from what the other cameras show."""

    coverage: float
    """Share of it that the visual hull of all covers."""
    away: float
    """Degrees by which it must be moved to lie in the others' hull; NaN where they have none."""
    turned: float
    """Degrees by which its long axis is turned against the hull's; 0 where it has none."""

    @property
    def is_wrong(self) -> bool:
        """Whether the silhouette contradicts the others."""
        off = not (self.away <= AWAY and abs(self.turned) <= TURNED)
        return self.coverage < AGREEING or off


class MomentHull:
    """The silhouettes of one moment, and which voxels of a cube around the subject they hold."""

    def __init__(self, rig: CameraRig, masks: Mapping[int, Mask]):
        self.masks = dict(masks)
        cameras = {k: resized(rig.camera(rig.names[k]), (mask.shape[1], mask.shape[0])) for k, mask in masks.items()}
        self.cameras = cameras
        self.focal = {k: float(camera.focal_length) for k, camera in cameras.items()}
        self.cube: Cube = cube_around([*masks.values()], [cameras[k] for k in masks])
        self.pixels: dict[int, VoxelPixels] = {
            k: voxel_pixels(self.cube, cameras[k], mask.shape) for k, mask in masks.items()
        }
        self.outside: dict[int, np.ndarray] = {
            k: ~self.pixels[k].hits(widened_by_half_a_voxel(mask, self.pixels[k])) for k, mask in masks.items()
        }

    def hull(self, cameras: Sequence[int]) -> Bool[np.ndarray, "voxel"]:
        """The voxels that the silhouettes of some of the cameras hold."""
        return ~np.any([self.outside[k] for k in cameras], axis=0)

    def coverage(self, camera: int, hull: Bool[np.ndarray, "voxel"]) -> float:
        """The share of a camera's silhouette that a hull covers."""
        mask = self.masks[camera]
        return float((self.pixels[camera].silhouette_of(hull) & mask).sum() / max(mask.sum(), 1))

    def coverages(self, cameras: Sequence[int]) -> dict[int, float]:
        """By camera that share, for the hull of all of them."""
        hull = self.hull(cameras)
        return {camera: self.coverage(camera, hull) for camera in cameras}

    @cached_property
    def misfits(self) -> dict[int, Misfit]:
        """By camera how its silhouette differs from the others; wrong ones do not count as others.

        While a silhouette contradicts the rest, the camera is taken out without which the rest agrees best.
        """
        left, out = list(self.masks), {}
        current = {camera: self._misfit(camera, left) for camera in left}
        while len(left) > FEWEST_VIEWS - 1 and any(misfit.is_wrong for misfit in current.values()):
            rest = lambda camera: [other for other in left if other != camera]
            without = {camera: sum(self.coverages(rest(camera)).values()) for camera in left}
            worst = max(left, key=lambda camera: without[camera] - OWN_COVERAGE * current[camera].coverage)
            out[worst] = current[worst]
            left.remove(worst)
            current = {camera: self._misfit(camera, left) for camera in left}
        return {**current, **out}

    def _misfit(self, camera: int, cameras: Sequence[int]) -> Misfit:
        coverage = self.coverage(camera, self.hull(cameras))
        expected = self.pixels[camera].silhouette_of(self.hull([k for k in cameras if k != camera]))
        if not expected.any() or len(cameras) < FEWEST_VIEWS:
            return Misfit(coverage, 0.0 if expected.any() else float("nan"), 0.0)
        mask = self.masks[camera]
        away = float(np.rad2deg(np.arctan(smallest_shift(mask, expected) / self.focal[camera])))
        tight = expected.sum() < TIGHT * mask.sum()
        return Misfit(coverage, away, _turn(mask, expected) if tight else 0.0)


def smallest_shift(mask: Mask, region: Mask) -> float:
    """By how many pixels a mask must be moved to lie in a region as well as it can.

    The region may be larger: the visual hull of few cameras is, and its middle says little.
    """
    size = (max(mask.shape[1] // COARSER, 1), max(mask.shape[0] // COARSER, 1))
    small, wanted = (cv2.resize(m.astype(np.float32), size, interpolation=cv2.INTER_AREA) for m in (mask, region))
    shape = (2 * size[1], 2 * size[0])
    overlap = np.fft.irfft2(np.conj(np.fft.rfft2(small, shape)) * np.fft.rfft2(wanted, shape), shape)
    rows, columns = np.nonzero(overlap >= overlap.max() - ROUGHNESS * float(small.sum()))
    rows, columns = (np.where(k > n // 2, k - n, k) for k, n in ((rows, shape[0]), (columns, shape[1])))
    return COARSER * float(np.sqrt(rows**2 + columns**2).min())


def _turn(mask: Mask, expected: Mask) -> float:
    """Degrees by which the long axis of a silhouette is turned against another's; 0 where one has none."""
    (seen, long), (wanted, also_long) = _axis(mask), _axis(expected)
    return (seen - wanted + 90.0) % 180.0 - 90.0 if min(long, also_long) > ELONGATED else 0.0


def hulls_of(rig: CameraRig, moments: Sequence[Moment]) -> list[MomentHull]:
    """The hulls of the moments in which enough cameras show the subject."""
    return [MomentHull(rig, moment.masks) for moment in moments if len(moment.masks) >= FEWEST_VIEWS]


def mean_coverage(hulls: Sequence[MomentHull]) -> float:
    """The mean share of the silhouettes that their hulls cover; 1 where there is nothing to compare."""
    shares = [share for hull in hulls for share in hull.coverages([*hull.masks]).values()]
    return float(np.mean(shares)) if shares else 1.0


def camera_misfits(hulls: Sequence[MomentHull]) -> dict[int, Misfit]:
    """By camera the median misfit over all moments."""
    by_camera: dict[int, list[Misfit]] = {}
    for hull in hulls:
        for camera, misfit in hull.misfits.items():
            by_camera.setdefault(camera, []).append(misfit)
    return {camera: _median(cases) for camera, cases in sorted(by_camera.items())}


def _median(cases: Sequence[Misfit]) -> Misfit:
    coverage, turned = (float(np.median([getattr(c, key) for c in cases])) for key in ("coverage", "turned"))
    away = [case.away for case in cases if np.isfinite(case.away)]
    return Misfit(coverage, float(np.median(away)) if away else float("nan"), turned)


def _axis(mask: Mask) -> tuple[float, float]:
    """Direction of the long axis in degrees, and length over width."""
    places = np.argwhere(mask).astype(float)
    values, vectors = np.linalg.eigh(np.cov((places - places.mean(axis=0)).T) + 1e-9 * np.eye(2))
    return float(np.rad2deg(np.arctan2(vectors[0, 1], vectors[1, 1]))), float(np.sqrt(values[1] / values[0]))
