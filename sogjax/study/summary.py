"""An experiment's runs in a few numbers per row: means with their intervals, and significant differences.

An interval comes from a bootstrap over recordings, or over stretches of frames of a single one.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import t as student

from sogjax.quality.angle_errors import BETWEEN_BONES, AngleError
from sogjax.study.record import RunRecord

BLOCK = 10
"""Frames that are drawn together: the errors of neighbouring frames are alike."""
FEWEST_BLOCKS = 3
"""Blocks of one recording, at least; those of shorter ones are shorter."""
DRAWS = 2000
LEVEL = 0.95


class Interval(NamedTuple):
    """The range in which a mean lies; NaN where there is nothing to say it from."""

    low: float
    high: float

    @property
    def holds_zero(self) -> bool:
        """Whether a difference with this interval is not significant."""
        return not (self.low > 0.0 or self.high < 0.0)


def bootstrap_interval(
    clips: Sequence[Float[np.ndarray, "_"]],
    *,
    block: int = BLOCK,
    draws: int = DRAWS,
) -> Interval:
    """Interval of the mean of all frames of all clips: Student's t with the standard error of a bootstrap.

    Recordings are drawn with replacement as a whole, since their frames are alike (cluster bootstrap). Of a single one
    stretches of frames are drawn: that says nothing of other recordings.
    Percentiles of so few pieces would be too narrow, so the error is that of a sample (n / (n - 1)) and the quantile
    that of n - 1 degrees of freedom. NaN is left out beforehand.
    """
    present = [values for clip in clips if (values := np.asarray(clip, float)[np.isfinite(clip)]).size]
    if len(present) == 1:
        present = _blocks(present[0], block)
    count = len(present)
    if count < 2:
        return Interval(float("nan"), float("nan"))
    sums, lengths = np.array([clip.sum() for clip in present]), np.array([len(clip) for clip in present], float)
    drawn = np.random.default_rng(0).integers(count, size=(draws, count))
    means = sums[drawn].sum(axis=1) / lengths[drawn].sum(axis=1)
    half = student.ppf(0.5 + LEVEL / 2.0, count - 1) * means.std() * (count / (count - 1)) ** 0.5
    mean = sums.sum() / lengths.sum()
    return Interval(float(mean - half), float(mean + half))


def _blocks(clip: Float[np.ndarray, "_"], block: int) -> list[Float[np.ndarray, "_"]]:
    """A clip as stretches of frames; none where it is too short for `FEWEST_BLOCKS`."""
    size = min(block, len(clip) // FEWEST_BLOCKS)
    return np.array_split(clip, len(clip) // size) if size else []


Records = Mapping[str, RunRecord]
"""The runs of one row, by recording."""
UNKNOWN = float("nan")


@dataclass(frozen=True)
class Difference:
    """The difference of a row's error to that of the reference, in the same frames of the same recordings."""

    mean: float
    """Millimetres; positive: the row is worse."""
    interval: Interval
    recordings: int
    """Recordings that it was taken on."""

    @property
    def is_significant(self) -> bool:
        """Whether its interval leaves out zero; a single recording cannot tell."""
        return self.recordings > 1 and not self.interval.holds_zero


@dataclass(frozen=True)
class RowSummary:
    """One row of an experiment over all its recordings. Errors in millimetres."""

    name: str
    paper: str
    paper_value: float | None
    mean: float
    std: float
    """Over all distances of all recordings."""
    closest: float
    """The mean with markers attached by the rule of Section 6, `closest`; `mean` is by `scaled`."""
    closest_std: float
    interval: Interval
    """The interval of the mean, at 95 %."""
    difference: Difference | None
    """None: this is the reference, or nothing can be compared."""
    is_reference: bool
    joints: float
    lost: int
    swaps: int
    iterations: float
    not_converged: int
    milliseconds: float
    """The median of a tracking step; the mean over the recordings."""
    image_blobs: float
    rates: Mapping[str, float]
    by_recording: Mapping[str, float]
    """The mean error on each."""
    iterations_by_recording: Mapping[str, float]
    angles: Sequence[AngleError]
    """Errors of joint angles on all recordings whose truth has any."""
    failed: Sequence[str]


def summarized(
    rows: Mapping[str, Records], reference: str | None, papers: Mapping[str, tuple[str, float | None]]
) -> list[RowSummary]:
    """A summary of every row.

    Args:
        rows: the runs of each row.
        reference: the row that the others are compared with, the first one with runs where it has none; None: none is.
        papers: what the paper says of a row, in words and as a number.
    """
    worked = [name for name, records in rows.items() if any(not record.failed for record in records.values())]
    compared = reference if reference is None or reference in worked or not worked else worked[0]
    return [
        _summary(name, records, {} if compared is None else None if name == compared else rows[compared], papers[name])
        for name, records in rows.items()
    ]


def _summary(name: str, records: Records, reference: Records | None, paper: tuple[str, float | None]) -> RowSummary:
    done = {source: record for source, record in records.items() if not record.failed}
    runs = list(done.values())
    errors = [record.errors for record in runs]
    closest = [np.asarray(record.closest_mm, float) for record in runs]
    average = lambda value: _mean([value(record) for record in runs])
    return RowSummary(
        name=name,
        paper=paper[0],
        paper_value=paper[1],
        mean=_mean(_joined(errors)),
        std=pooled_std(errors, [record.std_mm for record in runs]),
        closest=_mean(_joined(closest)),
        closest_std=pooled_std(closest, [record.closest_std_mm for record in runs]),
        interval=bootstrap_interval(errors),
        difference=None if reference is None else _difference(done, reference),
        is_reference=reference is None,
        joints=_mean(_joined([np.asarray(record.joint_error_mm, float) for record in runs])),
        lost=sum(record.lost for record in runs),
        swaps=sum(record.swaps for record in runs),
        iterations=average(lambda record: _mean(record.iterations)),
        not_converged=sum(not one for record in runs for one in record.converged),
        milliseconds=average(lambda record: record.step_ms),
        image_blobs=average(lambda record: record.image_blobs),
        rates=_mean_rates(runs),
        by_recording={source: _mean(record.errors) for source, record in done.items()},
        iterations_by_recording={source: _mean(record.iterations) for source, record in done.items()},
        angles=[AngleError(**error) for run in runs for error in run.angles if error["plane"] != BETWEEN_BONES],
        failed=tuple(f"{source}: {record.failed}" for source, record in records.items() if record.failed),
    )


def pooled_std(runs: Sequence[Float[np.ndarray, "_"]], stds: Sequence[float]) -> float:
    """Standard deviation over the distances of all runs, from the means of each one's frames and its own deviation.

    Every frame of a run has as many distances.
    """
    counts = np.array([np.isfinite(errors).sum() for errors in runs], float)
    if not counts.sum() > 0.0:
        return UNKNOWN
    present = counts > 0
    counts, means = counts[present], np.array([_mean(errors) for errors in runs])[present]
    deviations = np.asarray(stds, float)[present]
    weights = counts / counts.sum()
    return float(np.sqrt(np.sum(weights * (deviations**2 + (means - np.sum(weights * means)) ** 2))))


def _difference(records: Records, reference: Records) -> Difference | None:
    pairs = [
        frame_differences(record, reference[source])
        for source, record in records.items()
        if source in reference and not reference[source].failed
    ]
    pairs = [pair for pair in pairs if np.isfinite(pair).any()]
    return Difference(_mean(_joined(pairs)), bootstrap_interval(pairs), len(pairs)) if pairs else None


def frame_differences(record: RunRecord, reference: RunRecord) -> Float[np.ndarray, "_"]:
    """Error less the reference's, in the frames that both have."""
    _, ours, theirs = np.intersect1d(record.frames, reference.frames, return_indices=True)
    return record.errors[ours] - reference.errors[theirs]


def _mean_rates(runs: Sequence[RunRecord]) -> dict[str, float]:
    stages = dict.fromkeys(stage for record in runs for stage in record.rates)
    rate: Callable[[str], float] = lambda stage: _mean([record.rates.get(stage, UNKNOWN) for record in runs])
    return {stage: rate(stage) for stage in stages}


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate([*parts, np.zeros(0)])


def _mean(values: Sequence[float] | Sequence[int] | np.ndarray) -> float:
    """The mean of those that are finite; NaN where none is."""
    present = np.asarray(values, float)
    present = present[np.isfinite(present)]
    return float(present.mean()) if present.size else UNKNOWN
