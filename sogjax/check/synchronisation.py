"""Time offsets between cameras, from what moves; and frames that one camera lost or repeated on the way.

Where a camera lost or repeated frames, its offset at the end of a clip differs from that at its beginning.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.check.findings import Finding
from sogjax.check.motion import PairCodes, lag_curve
from sogjax.errors import counted, listed

FEWEST_STEPS = 8
"""Steps from a frame to the next without which offsets are not looked for."""
LEAST_ALIKE, LEAST_MARGIN, LEAST_SHARP = 0.35, 0.03, 0.01
"""Correlation of motions that are the same; how far it falls at other offsets; and, if the offset is one frame, at the
neighbouring ones. Of a walk before four cameras in step it fell there by 0.008 for one of them."""
REFITS = 10
"""Rounds of either fit at most; a few suffice."""


@dataclass(frozen=True)
class Synchrony:
    """Offsets of the cameras' files, in frames, beyond those that the recording knows already."""

    names: tuple[str, ...]
    offsets: Int[np.ndarray, "camera"]
    """Frame t of a camera is frame t + offset of its file; the most frequent one is 0."""
    sure: Bool[np.ndarray, "camera"]
    alike: Float[np.ndarray, "camera"]
    """Mean correlation of a camera's motion with the others', at these offsets."""
    margins: Float[np.ndarray, "camera"]
    """How far that falls at any other offset but the neighbouring ones."""
    sharpness: Float[np.ndarray, "camera"]
    """How far that falls at the neighbouring ones."""

    @property
    def followed(self) -> Bool[np.ndarray, "camera"]:
        """Whether a camera's motion is that of the others at its offset, and at no other but the neighbouring ones."""
        return (self.alike > LEAST_ALIKE) & (self.margins > LEAST_MARGIN)

    def of(self, camera: int) -> int:
        """The offset of a camera, 0 where it is uncertain."""
        return int(self.offsets[camera]) if self.sure[camera] else 0

    def numbers(self) -> dict[str, dict[str, Any]]:
        """What was found of each camera, as plain numbers."""
        rows = zip(self.names, self.offsets, self.sure, self.alike, self.margins, strict=True)
        return {
            name: {"offset": int(offset), "sure": bool(sure), "alike": round(float(a), 4), "margin": round(float(m), 4)}
            for name, offset, sure, a, m in rows
        }


def synchrony(names: tuple[str, ...], codes: PairCodes, steps: int, largest: int) -> Synchrony:
    """Offsets of at most `largest` frames between the cameras, by least squares over all pairs.

    A camera's offset is believed where its mean correlation with the others is high, and falls away from there; that of
    a single frame where it falls to none as well.
    """
    count = len(names)
    most = min(largest, steps // 3)
    curves = {pair: lag_curve(*both, most) for pair, both in codes.items()} if steps >= FEWEST_STEPS else {}
    offsets = _refined(_least_squares(curves, count, most), curves, most)
    offsets = offsets - int(np.bincount(offsets - offsets.min()).argmax()) - offsets.min()
    alike, margins, sharpness = _support(offsets, curves, most)
    found = Synchrony(names, offsets, np.zeros(count, bool), alike, margins, sharpness)
    return replace(found, sure=found.followed & ((np.abs(offsets) != 1) | (sharpness > LEAST_SHARP)))


def _least_squares(curves: Mapping[tuple[int, int], np.ndarray], count: int, most: int) -> Int[np.ndarray, "camera"]:
    """Offsets that explain the best lags of pairs that are alike, with those that fit badly weighted down (Huber)."""
    kept = {pair: curve for pair, curve in curves.items() if curve.max() > 0.4}
    if not kept:
        return np.zeros(count, int)
    rows = np.zeros((len(kept), count))
    for k, (a, b) in enumerate(kept):
        rows[k, a], rows[k, b] = 1.0, -1.0
    lags = np.array([int(curve.argmax()) - most for curve in kept.values()], float)
    trust = np.array([float(curve.max()) ** 2 for curve in kept.values()])
    weights = trust
    offsets = np.zeros(count)
    for _ in range(REFITS):
        root = np.sqrt(weights)[:, None]
        offsets = np.linalg.lstsq(root * rows, root[:, 0] * lags, rcond=1e-9)[0]
        offsets = offsets - np.median(offsets)
        weights = trust / np.maximum(np.abs(rows @ offsets - lags), 0.5)
    return np.rint(offsets).astype(int)


def _refined(
    offsets: Int[np.ndarray, "camera"], curves: Mapping[tuple[int, int], np.ndarray], most: int
) -> Int[np.ndarray, "camera"]:
    """One camera after the other moved to where its motion is most like the others'."""
    offsets = offsets.copy()
    for _ in range(REFITS):
        before = offsets.copy()
        for camera in range(len(offsets)):
            scores = _scores(camera, offsets, curves, most)
            if scores is not None:
                offsets[camera] = int(scores.argmax()) + int(np.median(offsets)) - most
        if (offsets == before).all():
            break
    return offsets


def _scores(
    camera: int, offsets: Int[np.ndarray, "camera"], curves: Mapping[tuple[int, int], np.ndarray], most: int
) -> Float[np.ndarray, "lag"] | None:
    """Mean correlation with the others if the camera's offset were the median + lag, for lags -most to most.

    Pairs count by how alike they can be at all; a camera that sees the subject from elsewhere tells little.
    """
    middle = int(np.median(offsets))
    total, weight = np.zeros(2 * most + 1), 1e-9
    for (a, b), curve in curves.items():
        if camera not in (a, b):
            continue
        other, sign = (b, 1) if camera == a else (a, -1)
        lags = sign * (middle + np.arange(-most, most + 1) - offsets[other])
        trust = max(float(curve.max()), 0.0) ** 2
        inside = np.abs(lags) <= most
        values = np.where(inside, curve[np.clip(lags, -most, most) + most], curve.min())
        total += trust * values
        weight += trust
    return total / weight if weight > 1e-6 else None


def _support(
    offsets: Int[np.ndarray, "camera"], curves: Mapping[tuple[int, int], np.ndarray], most: int
) -> tuple[Float[np.ndarray, "camera"], Float[np.ndarray, "camera"], Float[np.ndarray, "camera"]]:
    """The mean correlation at each camera's offset, and how far it falls elsewhere and beside it."""
    alike, margins, sharpness = np.zeros(len(offsets)), np.zeros(len(offsets)), np.zeros(len(offsets))
    for camera in range(len(offsets)):
        scores = _scores(camera, offsets, curves, most)
        place = int(offsets[camera] - int(np.median(offsets))) + most
        if scores is None or not 0 <= place < len(scores):
            continue
        near = [k for k in range(place - 1, place + 2) if 0 <= k < len(scores)]
        elsewhere = np.delete(scores, near)
        alike[camera] = scores[place]
        margins[camera] = scores[place] - elsewhere.max() if len(elsewhere) else 0.0
        sharpness[camera] = scores[place] - max((scores[k] for k in near if k != place), default=0.0)
    return alike, margins, sharpness


def too_short(frames: int, available: int) -> Finding:
    """The finding that the clip is too short for offsets; the recording has `available` frames."""
    needed = FEWEST_STEPS + 1
    what = f"time offsets cannot be estimated: the clip is too short, {counted(frames, 'frame')} of {needed} needed"
    remedy = f"give frames={needed} or more" if available >= needed else "record more frames"
    return Finding("note", "synchronisation", what, "", remedy)


def synchrony_findings(
    found: Synchrony,
    known: Mapping[str, int],
    moving: bool,
    jumped: Collection[int] = (),
    away: Collection[int] = (),
) -> list[Finding]:
    """Cameras that are late, early or uncertain.

    Args:
        found: the offsets.
        known: those that the recording has already.
        moving: whether anything moves.
        jumped: cameras whose offset changes on the way, so that no number mends it.
        away: cameras that have too few pictures to determine anything.
    """
    if len(found.names) < 2:
        return []
    if not moving or not found.sure.any():
        what = "time offsets cannot be estimated: several cameras hardly see anything move"
        return [Finding("note", "synchronisation", what, "", "record a clap or a jump at the beginning")]
    findings = []
    late = [k for k in np.flatnonzero(found.sure) if found.offsets[k] != 0 and k not in jumped]
    for k in late:
        name, offset = found.names[k], int(found.offsets[k])
        when = "later" if offset > 0 else "earlier"
        what = f"{name} shows everything {counted(abs(offset), 'frame')} {when} than the others"
        remedy = f"write `frame_offset: {{{name}: {known[name] + offset}}}` into recording.yaml, or add write=true"
        cause = "cameras that were not started or triggered together"
        findings.append(Finding("warning", "synchronisation", what, cause, remedy, (name,)))
    fits = (np.abs(found.offsets) == 1) & found.followed
    either = tuple(name for k, name in enumerate(found.names) if not found.sure[k] and fits[k] and k not in away)
    if either:
        what = f"the motion in {listed(either)} fits that of the others as well a frame later or earlier"
        findings.append(Finding("note", "synchronisation", what, "", "record a clap or a jump", cameras=either))
    unsure = tuple(name for k, name in enumerate(found.names) if not (found.sure[k] or fits[k]) and k not in away)
    if unsure:
        what = f"time offsets of {listed(unsure)} could not be determined: the motion there does not match the others'"
        cause = "little of the motion is in their pictures, or their calibration or names are wrong"
        findings.append(Finding("note", "synchronisation", what, cause, cameras=unsure))
    if not late:
        what = f"in step: {int(found.sure.sum()) - len(jumped)} of {counted(len(found.names), 'camera')}"
        findings.append(Finding("ok", "synchronisation", what))
    return findings


@dataclass(frozen=True)
class Jump:
    """A camera whose time jumps against the others' within a clip."""

    frames: int
    """Positive: so many frames are lost; negative: repeated or added."""


def find_jumps(codes: PairCodes, steps: int, whole: Synchrony) -> dict[int, Jump]:
    """The difference of each camera's offsets in the two halves of a clip, where both are certain and sharp.

    Three frames at most are looked for beyond the offset of the whole, in halves of 16 steps or more.
    """
    half = steps // 2
    if half < 16:
        return {}
    largest = 3 + int(abs(whole.offsets).max())
    early, late = (
        synchrony(whole.names, {pair: (a[part], b[part]) for pair, (a, b) in codes.items()}, half, largest)
        for part in (slice(0, half), slice(half, steps))
    )
    sharp = np.sort([early.sharpness, late.sharpness], axis=0)
    sure = whole.followed & early.sure & late.sure & (sharp[0] > 0.01) & (sharp[1] > 0.06)
    sure &= early.offsets != late.offsets
    return {int(k): Jump(int(early.offsets[k] - late.offsets[k])) for k in sure.nonzero()[0]}
