"""Whether the silhouettes of all cameras show one thing: each is compared with the visual hull of the others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from sogjax.check.pictures import Mask, Moment
from sogjax.io.calibration.rig import CameraRig
from sogjax.scene.visual_hull import AGREEING, OWN_COVERAGE, MaskHull, resized

FEWEST_VIEWS = 3
"""With two silhouettes that disagree, nothing tells which is wrong."""


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
        """Whether it contradicts the others: masks and calibrations are too rough for 0.75 and 4 degrees to count."""
        return self.coverage < AGREEING or not (self.away <= 0.75 and abs(self.turned) <= 4.0)


class MomentHull:
    """The silhouettes of one moment, and which voxels of a cube around the subject they hold."""

    def __init__(self, rig: CameraRig, masks: Mapping[int, Mask]):
        self.masks = dict(masks)
        self.cameras = {k: resized(rig.camera(rig.names[k]), mask.shape[1::-1]) for k, mask in masks.items()}
        self._hulls = MaskHull.of_masks(masks, self.cameras)
        self.cube, self.coverages = self._hulls.cube, self._hulls.coverages

    @cached_property
    def misfits(self) -> dict[int, Misfit]:
        """How each camera's silhouette differs from the others; wrong ones do not count as others.

        While a silhouette contradicts the rest, the camera is taken out without which the rest agrees best.
        """
        left, out = list(self.masks), {}
        current = self._misfits(left)
        while len(left) > FEWEST_VIEWS - 1 and any(misfit.is_wrong for misfit in current.values()):
            rest = lambda camera: [other for other in left if other != camera]
            without = {camera: sum(self.coverages(rest(camera)).values()) for camera in left}
            worst = max(left, key=lambda camera: without[camera] - OWN_COVERAGE * current[camera].coverage)
            out[worst] = current[worst]
            left.remove(worst)
            current = self._misfits(left)
        return {**current, **out}

    def _misfits(self, cameras: Sequence[int]) -> dict[int, Misfit]:
        """How the silhouette of each of these cameras differs from the others, none of which is left out."""
        found = {}
        for camera, coverage in self.coverages(cameras).items():
            mask = self.masks[camera]
            expected = self._hulls.pixels[camera].silhouette_of(self._hulls.hull([k for k in cameras if k != camera]))
            if not expected.any() or len(cameras) < FEWEST_VIEWS:
                found[camera] = Misfit(coverage, 0.0 if expected.any() else float("nan"), 0.0)
                continue
            away = np.arctan(smallest_shift(mask, expected) / float(self.cameras[camera].focal_length))
            tight = expected.sum() < 1.5 * mask.sum()  # a larger hull does not show how the silhouette is turned
            found[camera] = Misfit(coverage, float(np.rad2deg(away)), _turn(mask, expected) if tight else 0.0)
        return found


def smallest_shift(mask: Mask, region: Mask) -> float:
    """The number of pixels by which a mask must be moved to lie in a region as well as it can.

    The region may be larger: the visual hull of few cameras is, and its middle says little. Errors of the outline may
    take 3 % of the mask from an overlap. The search steps by two pixels.
    """
    size = (max(mask.shape[1] // 2, 1), max(mask.shape[0] // 2, 1))
    small, wanted = (cv2.resize(m.astype(np.float32), size, interpolation=cv2.INTER_AREA) for m in (mask, region))
    shape = (2 * size[1], 2 * size[0])
    overlap = np.fft.irfft2(np.conj(np.fft.rfft2(small, shape)) * np.fft.rfft2(wanted, shape), shape)
    rows, columns = np.nonzero(overlap >= overlap.max() - 0.03 * float(small.sum()))
    rows, columns = (np.where(k > n // 2, k - n, k) for k, n in ((rows, shape[0]), (columns, shape[1])))
    return 2 * float(np.sqrt(rows**2 + columns**2).min())


def _turn(mask: Mask, expected: Mask) -> float:
    """Degrees by which the long axis of a silhouette is turned against another's; 0 where one is not elongated."""
    (seen, long), (wanted, also_long) = _axis(mask), _axis(expected)
    return (seen - wanted + 90.0) % 180.0 - 90.0 if min(long, also_long) > 2.5 else 0.0


def _axis(mask: Mask) -> tuple[float, float]:
    """Direction of the long axis in degrees, and length over width."""
    places = np.argwhere(mask).astype(float)
    values, vectors = np.linalg.eigh(np.cov((places - places.mean(axis=0)).T) + 1e-9 * np.eye(2))
    return float(np.rad2deg(np.arctan2(vectors[0, 1], vectors[1, 1]))), float(np.sqrt(values[1] / values[0]))


def hulls_of(rig: CameraRig, moments: Sequence[Moment]) -> list[MomentHull]:
    """The hulls of the moments in which enough cameras show the subject."""
    return [MomentHull(rig, moment.masks) for moment in moments if len(moment.masks) >= FEWEST_VIEWS]


def mean_coverage(hulls: Sequence[MomentHull]) -> float:
    """The mean share of the silhouettes that their hulls cover; 1 where there is nothing to compare."""
    shares = [share for hull in hulls for share in hull.coverages([*hull.masks]).values()]
    return float(np.mean(shares)) if shares else 1.0


def camera_misfits(hulls: Sequence[MomentHull]) -> dict[int, Misfit]:
    """The median misfit of each camera over all moments."""
    by_camera: dict[int, list[Misfit]] = {}
    for hull in hulls:
        for camera, misfit in hull.misfits.items():
            by_camera.setdefault(camera, []).append(misfit)
    return {camera: _median(cases) for camera, cases in sorted(by_camera.items())}


def _median(cases: Sequence[Misfit]) -> Misfit:
    coverage, turned = (float(np.median([getattr(c, key) for c in cases])) for key in ("coverage", "turned"))
    away = [case.away for case in cases if np.isfinite(case.away)]
    return Misfit(coverage, float(np.median(away)) if away else float("nan"), turned)
