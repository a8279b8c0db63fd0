"""How long the stages of a command take, by the clock and as rates.

Both are spans of time, noted by stage in a `StageTimes`. A `Clock` notes them for the command itself, one stage after
the other, so its lines add up to the whole. The threads of tracking decode, average, track and write frames beside each
other, which adds up to nothing: there the spans are those of single frames, and the table tells rates, without the
first frame, which waits for programs to be compiled.
"""

import os
import time
from array import array
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

Item = TypeVar("Item")
Turn = Callable[[str], None]
"""Called with the name of a stage that takes the place of the one that runs."""

STARTING, RENDERING, ACTORS, INITIAL_POSE = "starting the program", "rendering", "actors", "initial pose"
PREPARING, BACKGROUND = "background and compilation", "learning the background again"
BEFORE, FIRST_FRAME, TRACKING = "tracking back from the initial pose", "first frame, with compilation", "tracking"
BOTH_WAYS, ADJUSTING, FILTERING = "tracking both ways", "adjusting", "filtering"
WRITING, PAGE = "writing results", "writing the page"
OTHER, TOTAL = "other", "total"
STAGES = (
    *(STARTING, RENDERING, ACTORS, INITIAL_POSE, PREPARING, BACKGROUND, BEFORE),
    *(FIRST_FRAME, TRACKING, BOTH_WAYS, ADJUSTING, FILTERING, WRITING, PAGE),
)
"""Stages of a clock, in the order in which they are shown; those of other names come after them."""
STEP_STAGES = {
    "decode": "waiting for decoded pictures",
    "cells": "averaging pictures to cells",
    "step": "tracking step",
    "outputs": "writing results",
    "whole": "decoding to pose, together",
}
"""The stages of a frame, and their names in the table."""
WAITING = ("decode",)
"""Stages of a frame that only wait, so that their rate means nothing."""
SHORTEST, LEAST_SHARE = 0.05, 0.01
"""Seconds of the clock, and share of the frames' time, below which a stage gets no line."""


@dataclass
class StageTimes:
    """Seconds of every span of time, by stage."""

    seconds: dict[str, array] = field(default_factory=dict)

    def add(self, stage: str, seconds: float) -> None:
        """Note a span, such as that of one frame."""
        self.seconds.setdefault(stage, array("d")).append(seconds)

    def timed(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """The items, noting how long each takes to arrive."""
        iterator, end = iter(items), object()
        begin = time.perf_counter()
        while (item := next(iterator, end)) is not end:
            self.add(stage, time.perf_counter() - begin)
            yield item  # pyright: ignore[reportReturnType]
            begin = time.perf_counter()

    def total(self, stage: str, skipped: int = 0) -> float:
        """Seconds of a stage without its first spans."""
        return float(sum(self.seconds.get(stage, array("d"))[skipped:]))

    def frames_per_second(self, stage: str, skipped: int = 1) -> float:
        """Rate of a stage without its first frames; NaN where there are no others."""
        total = self.total(stage, skipped)
        return (len(self.seconds[stage]) - skipped) / total if total > 0.0 else float("nan")

    def table(self) -> str:
        """A line for each stage of a frame with its rate, or with the seconds that were waited."""
        lines, least = [], LEAST_SHARE * self.total("whole", 1)
        for stage, text in STEP_STAGES.items():
            if (total := self.total(stage, 1)) > least:
                waits, rate = f"{total:10.1f} s in all", f"{self.frames_per_second(stage):10.1f} frames/s"
                lines.append(f"{text:<32}{waits if stage in WAITING else rate}")
        return "\n".join(lines)


class Clock:
    """Seconds by stage, since the clock was made and `before`; a stage within another one counts for itself alone."""

    def __init__(self, before: float = 0.0):
        self._times, self._open, self._since = StageTimes(), [OTHER], time.perf_counter()
        self._times.add(STARTING, before)

    def turn(self, stage: str) -> None:
        """End the stage that runs, and begin another one in its place."""
        now = time.perf_counter()
        self._times.add(self._open[-1], now - self._since)
        self._since, self._open[-1] = now, stage

    @contextmanager
    def within(self, stage: str) -> Iterator[Turn]:
        """Count the block as a stage within the one that runs, which goes on after it."""
        around = self._open[-1]
        self.turn(around)
        self._open.append(stage)
        try:
            yield self.turn
        finally:
            self.turn(OTHER)
            self._open.pop()

    def seconds(self) -> dict[str, float]:
        """Seconds of every stage so far that took time; `OTHER` and the `TOTAL` come last."""
        self.turn(self._open[-1])
        stages = [stage for stage in dict.fromkeys((*STAGES, *self._times.seconds)) if stage != OTHER]
        found = {stage: self._times.total(stage) for stage in stages if self._times.total(stage)}
        total = sum(map(self._times.total, self._times.seconds))
        return found | {OTHER: total - sum(found.values()), TOTAL: total}

    def table(self) -> str:
        """A line for each stage that took time, to a tenth of a second, such that the lines add up to the total."""
        seconds = self.seconds()
        total = seconds.pop(TOTAL)
        shown = {stage: value for stage, value in seconds.items() if value >= SHORTEST and stage != OTHER}
        lines, so_far = [], 0.0
        for stage, value in (shown | {OTHER: total - sum(shown.values())}).items():
            tenths = round(10.0 * (so_far + value)) - round(10.0 * so_far)
            lines.append(f"{stage:<32}{0.1 * tenths:10.1f} s")
            so_far += value
        return "\n".join([*lines, f"{TOTAL:<32}{0.1 * round(10.0 * total):10.1f} s"])


_running: ContextVar[Clock | None] = ContextVar("_running", default=None)


@contextmanager
def clocked(before: float = 0.0) -> Iterator[Clock]:
    """The clock of what runs within the block: the one that runs already, else a new one, `before` seconds fast."""
    clock = _running.get() or Clock(before)
    token = _running.set(clock)
    try:
        yield clock
    finally:
        _running.reset(token)


@contextmanager
def stage(name: str) -> Iterator[Turn]:
    """Count the block as a stage of the clock that runs, if one does in this thread; other threads count nothing."""
    clock = _running.get()
    if clock is None:
        yield lambda _: None
        return
    with clock.within(name) as turn:
        yield turn


def seconds_so_far() -> dict[str, float]:
    """Seconds by stage of the clock that runs, rounded for a file; empty where none does."""
    clock = _running.get()
    return {} if clock is None else {name: round(value, 3) for name, value in clock.seconds().items()}


def age_of_process() -> float:
    """Seconds since this process began; 0 where the system does not say."""
    try:
        begun = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19]) / os.sysconf("SC_CLK_TCK")
        return max(time.clock_gettime(time.CLOCK_BOOTTIME) - begun, 0.0)
    except (OSError, ValueError, IndexError, AttributeError):
        return 0.0
