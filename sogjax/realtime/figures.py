"""The figures of a live run: latencies, intervals and what was lost, in memory that does not grow."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

SHORTEST, GROWTH, BINS = 1e-4, 1.01, 1400
"""Seconds of the first bin, what each next one is longer by, and how many there are: up to 110 s, to 1 %."""


STAGES = ("waiting", "queueing", "solving")
"""For the pictures of other cameras, for the tracker, and in it."""


@dataclass
class Durations:
    """How long something took, counted in bins."""

    counts: np.ndarray = field(default_factory=lambda: np.zeros(BINS, int))
    longest: float = 0.0
    total: float = 0.0
    squares: float = 0.0

    def add(self, seconds: float) -> None:
        """Count one."""
        place = int(math.log(max(seconds, SHORTEST) / SHORTEST) / math.log(GROWTH))
        self.counts[min(place, BINS - 1)] += 1
        self.longest = max(self.longest, seconds)
        self.total += seconds
        self.squares += seconds * seconds

    @property
    def number(self) -> int:
        """How many were counted."""
        return int(self.counts.sum())

    def percentile(self, percent: float | int) -> float:
        """What so many percent are not longer than, in seconds; 0 where none was counted."""
        if not self.number:
            return 0.0
        place = int(np.searchsorted(np.cumsum(self.counts), percent / 100.0 * self.number))
        return min(SHORTEST * GROWTH ** (place + 0.5), self.longest)

    def deviation(self) -> float:
        """Standard deviation in seconds."""
        mean = self.total / max(self.number, 1)
        return math.sqrt(max(self.squares / max(self.number, 1) - mean * mean, 0.0))

    def as_dict(self) -> dict[str, float]:
        """Percentiles and the maximum in milliseconds."""
        found = {f"p{percent}": round(1e3 * self.percentile(percent), 2) for percent in (50, 95, 99)}
        return found | {"max": round(1e3 * self.longest, 2)}


@dataclass(frozen=True)
class Stamps:
    """When what happened to one frame; seconds of `time.monotonic`."""

    exposed: float
    """When it was taken, or its pictures arrived where no camera tells."""
    arrived: float
    """When the first picture came."""
    handed_over: float
    """By the assembler."""
    begun: float
    """By the tracker."""
    solved: float
    sent: float

    @property
    def stages(self) -> dict[str, float]:
        """Seconds of each stage."""
        times = (self.arrived, self.handed_over, self.begun, self.solved)
        return {stage: end - begin for stage, begin, end in zip(STAGES, times, times[1:], strict=False)}


@dataclass
class Figures:
    """What is told of a run, on the terminal and in `live.json`."""

    latency: Durations = field(default_factory=Durations)
    """From the arrival of the first picture to sending."""
    from_exposure: Durations = field(default_factory=Durations)
    stages: dict[str, Durations] = field(default_factory=lambda: {stage: Durations() for stage in STAGES})
    intervals: Durations = field(default_factory=Durations)
    """From one message to the next."""
    poses: int = 0
    unsolved: int = 0
    """Sets in which nobody was tracked."""
    last: float | None = None
    """When the last one was sent, if the actors have been tracked since."""

    def add(self, stamps: Stamps, tracked: bool) -> None:
        """Count a frame."""
        if not tracked:
            self.unsolved += 1
            self.last = None
            return
        self.poses += 1
        self.latency.add(stamps.sent - stamps.arrived)
        self.from_exposure.add(stamps.sent - stamps.exposed)
        for stage, seconds in stamps.stages.items():
            self.stages[stage].add(seconds)
        if self.last is not None:
            self.intervals.add(stamps.sent - self.last)
        self.last = stamps.sent

    def as_dict(self, seconds: float) -> dict[str, Any]:
        """All of them; `seconds` is how long the run took."""
        return {
            "seconds": round(seconds, 3),
            "poses": self.poses,
            "poses_per_second": round(self.poses / max(seconds, 1e-6), 2),
            "latency_ms": self.latency.as_dict(),
            "latency_from_exposure_ms": self.from_exposure.as_dict(),
            "stages_ms": {stage: taken.as_dict() for stage, taken in self.stages.items()},
            "interval_ms": self.intervals.as_dict(),
            "jitter_ms": round(1e3 * self.intervals.deviation(), 2),
        }

    def line(self, overwritten: int) -> str:
        """A line for the terminal."""
        shown = self.latency
        return (
            f"{self.poses} poses, latency {1e3 * shown.percentile(50):.0f} ms (p95 {1e3 * shown.percentile(95):.0f}, "
            f"most {1e3 * shown.longest:.0f}), {overwritten} overwritten, {self.unsolved} without anybody"
        )
