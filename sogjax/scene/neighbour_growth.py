"""Which of the colours that a pixel shows again and again is the background: the one that continues what is beside it.

A pixel that was covered for a long time shows the subject's colour more often than the background's. What tells them
apart is the outline: the background goes on beyond it, the subject ends there. So the known background grows inwards,
pixel by pixel; across an edge of the background itself it grows where both sides were seen at the same times.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float, Int, UInt8, UInt64

MODES = 3
"""Groups that are looked for in each pixel."""


@dataclass(frozen=True)
class Modes:
    """Up to `MODES` groups of the samples of some pixels, the densest first."""

    colors: Float[np.ndarray, "mode 3 pixel"]
    """Mean of the members, BGR."""
    deviations: Float[np.ndarray, "mode pixel"]
    """Standard deviation of a channel among the members, grey levels."""
    members: Bool[np.ndarray, "mode sample pixel"]
    """Which samples belong to it; none where there is no such group."""

    @property
    def counts(self) -> np.ndarray:
        """How many samples belong to each."""
        return self.members.sum(axis=1)


def modes_of(
    samples: UInt8[np.ndarray, "sample 3 pixel"],
    usable: Bool[np.ndarray, "sample pixel"],
    tolerance: UInt8[np.ndarray, "pixel"],
) -> Modes:
    """The densest groups: samples whose every channel is within `tolerance` of the one with the most neighbours."""
    neighbours = np.where(usable, neighbour_counts(samples, usable, tolerance), 0)
    left, found = usable.copy(), []
    for _ in range(MODES):
        counts = np.where(left, neighbours, 0)
        centre = np.take_along_axis(samples, counts.argmax(axis=0)[None, None].repeat(3, axis=1), axis=0)[0]
        distance = _distance(samples, centre)
        members = left & (distance <= tolerance)
        found.append((*_mean_and_deviation(samples, members), members))
        left = left & (distance > 1.5 * tolerance)
    colors, deviations, members = (np.stack(part) for part in zip(*found, strict=True))
    return Modes(colors, deviations, members)


def neighbour_counts(
    samples: UInt8[np.ndarray, "sample 3 pixel"],
    usable: Bool[np.ndarray, "sample pixel"],
    tolerance: UInt8[np.ndarray, "pixel"],
) -> UInt8[np.ndarray, "sample pixel"]:
    """How many samples of the same pixel are within the tolerance of each, itself among them."""
    counts = usable.astype(np.uint8)
    for i in range(len(samples)):
        for j in range(i + 1, len(samples)):
            apart = cv2.absdiff(samples[i], samples[j])
            near = np.maximum(np.maximum(apart[0], apart[1]), apart[2]) <= tolerance
            near &= usable[i] & usable[j]
            counts[i] += near
            counts[j] += near
    return counts


def _distance(
    samples: UInt8[np.ndarray, "sample 3 pixel"], centre: UInt8[np.ndarray, "3 pixel"]
) -> UInt8[np.ndarray, "sample pixel"]:
    return np.stack([cv2.absdiff(sample, centre).max(axis=0) for sample in samples])


def _mean_and_deviation(
    samples: UInt8[np.ndarray, "sample 3 pixel"], members: Bool[np.ndarray, "sample pixel"]
) -> tuple[Float[np.ndarray, "3 pixel"], Float[np.ndarray, "pixel"]]:
    total, squares = np.zeros(samples.shape[1:], np.float32), np.zeros(samples.shape[1:], np.float32)
    for sample, member in zip(samples, members, strict=True):
        light = sample * member
        cv2.accumulate(light, total)
        cv2.accumulateSquare(light, squares)
    count = np.maximum(members.sum(axis=0), 1).astype(np.float32)
    mean = total / count
    return mean, np.sqrt(np.maximum(squares / count - mean * mean, 0.0).mean(axis=0))


MOST_APART = 60.0
"""Grey levels: larger steps of colour say no more."""
FEWEST_NEIGHBOURS = 3
"""Known neighbours that a pixel must suit."""
SHARE = 0.25
"""Share of the tolerance within which a colour clearly continues the background: with all of it, the subject is entered
through the one place where it looks like what is beside it, and then taken as a whole."""
_STEPS = np.array([(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)])


def grown(
    modes: Modes,
    zone: Bool[np.ndarray, "rows columns"],
    still: Bool[np.ndarray, "rows columns"],
    picture: Float[np.ndarray, "rows columns 3"],
    tolerance: UInt8[np.ndarray, "rows columns"],
    fewest: int,
    mostly: bool = False,
) -> Int[np.ndarray, "pixel"]:
    """Which mode of each of the zone's pixels is the background, -1 where that is unknown.

    A step of colour to a neighbour counts as far as the two were not seen at the same times: 0 where they always were.

    Args:
        modes: of the pixels of the zone.
        zone: the background is known around it.
        still: where in it a colour that is always there may be the subject's; elsewhere it is the background.
        picture: the background there.
        tolerance: for each pixel, the step of colour up to which it may show the same thing as its neighbour.
        fewest: samples that must show a colour.
        mostly: whether, across an edge, a pixel must show the colour most often.
    """
    field = _Field(modes, zone, picture, fewest, mostly)
    always = np.flatnonzero((modes.counts[0] == modes.members.shape[1]) & ~still[field.rows, field.columns])
    field.take(always, np.zeros(len(always), int))
    front = field.beside_known()
    while len(front):
        cost = field.costs(front)
        best = cost.argmin(axis=0)
        accepted = cost[best, np.arange(len(front))] <= SHARE * tolerance[field.rows[front], field.columns[front]]
        front = field.take(front[accepted], best[accepted])
    return field.chosen


class _Field:
    """The known background, which grows; with a border of one pixel around the picture."""

    def __init__(
        self,
        modes: Modes,
        zone: Bool[np.ndarray, "rows columns"],
        picture: Float[np.ndarray, "rows columns 3"],
        fewest: int,
        mostly: bool,
    ):
        num_samples = modes.members.shape[1]
        self.rows, self.columns = np.nonzero(zone)
        self.chosen = np.full(len(self.rows), -1)
        self._colors = modes.colors
        self._seen = _bits(modes.members)
        self._enough = (modes.counts >= fewest) & (
            modes.counts < num_samples
        )  # nothing tells whose a colour is that is always there
        self._across = 1 if mostly else MODES
        self._number = np.pad(np.full(zone.shape, -1), 1, constant_values=-1)
        self._number[self.rows + 1, self.columns + 1] = np.arange(len(self.rows))
        self._known = np.pad(~zone, 1)
        self._picture = np.pad(picture, ((1, 1), (1, 1), (0, 0)))
        self._all = _bits(np.ones((num_samples, 1), bool))[0]
        self._times = np.full(self._known.shape, self._all)

    def beside_known(self) -> Int[np.ndarray, "pixel"]:
        """Undecided pixels of the zone that lie beside known background."""
        near = np.zeros_like(self._known)
        for down, right in _STEPS.tolist():
            near |= np.roll(self._known, (down, right), (0, 1))
        return np.flatnonzero(near[self.rows + 1, self.columns + 1] & (self.chosen < 0))

    def costs(self, front: Int[np.ndarray, "pixel"]) -> Float[np.ndarray, "mode pixel"]:
        """Mean step of colour from each mode to the known neighbours that it suits best."""
        row, column = self._around(self.rows[front] + 1, self.columns[front] + 1)
        colors, beside = self._colors[:, :, front], np.moveaxis(self._picture[row, column], -1, 0)
        steps = [np.abs(colors[:, k] - beside[k][:, None]) for k in range(3)]
        step = np.minimum(np.maximum(np.maximum(steps[0], steps[1]), steps[2]), MOST_APART)
        step[:, : self._across] *= 1.0 - self._together(front, self._times[row, column][:, None])
        found = np.where(self._known[row, column][:, None], step, MOST_APART).astype(np.float32)
        nearest = np.partition(found, FEWEST_NEIGHBOURS - 1, axis=0)[:FEWEST_NEIGHBOURS].mean(axis=0)
        return np.where(self._enough[:, front], nearest, np.inf)

    def _together(
        self, front: Int[np.ndarray, "pixel"], times: UInt64[np.ndarray, "step 1 pixel"]
    ) -> Float[np.ndarray, "step mode pixel"]:
        """How much both were seen, and both hidden, at the same times: the smaller of the two overlaps."""
        seen = self._seen[: self._across, front]
        return np.minimum(_overlap(seen, times), _overlap(~seen & self._all, ~times & self._all))

    def _around(
        self, row: Int[np.ndarray, "pixel"], column: Int[np.ndarray, "pixel"]
    ) -> tuple[Int[np.ndarray, "step pixel"], Int[np.ndarray, "step pixel"]]:
        """The neighbours of pixels."""
        return row + _STEPS[:, :1], column + _STEPS[:, 1:]

    def take(self, pixels: Int[np.ndarray, "pixel"], modes: Int[np.ndarray, "pixel"]) -> Int[np.ndarray, "next"]:
        """Add pixels to the known background; returns the undecided ones beside them."""
        row, column = self.rows[pixels] + 1, self.columns[pixels] + 1
        self.chosen[pixels] = modes
        self._known[row, column] = True
        self._picture[row, column] = self._colors[modes, :, pixels]
        self._times[row, column] = self._seen[modes, pixels]
        around = self._number[self._around(row, column)]
        around = np.unique(around[around >= 0])
        return around[self.chosen[around] < 0]


def _bits(members: Bool[np.ndarray, "*mode sample pixel"]) -> np.ndarray:
    """Which samples are members, at most 64, as the bits of a number for each mode and pixel."""
    packed = np.packbits(members, axis=-2, bitorder="little")
    whole = np.zeros((*members.shape[:-2], members.shape[-1], 8), np.uint8)
    whole[..., : packed.shape[-2]] = np.moveaxis(packed, -2, -1)
    return whole.view(np.uint64)[..., 0]


def _overlap(a: np.ndarray, b: np.ndarray) -> Float[np.ndarray, "step mode pixel"]:
    """Samples that both sets have, as a share of those that one of them has."""
    both, either = np.bitwise_count(a & b), np.bitwise_count(a | b)
    return both / np.maximum(either, 1).astype(np.float32)
