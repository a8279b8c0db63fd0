"""The time of a command on the clock, by stage: the stages add up to the whole.

How fast the stages of tracking are that run beside each other, without the first frames, which compile.
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

STARTING, RENDERING, ACTORS, FIRST_POSE = "starting the program", "rendering", "actors", "first pose"
PREPARING, BACKGROUND = "background and compilation", "learning the background again"
BEFORE, FIRST_FRAME, TRACKING = "tracking back from the first pose", "first frame, with compilation", "tracking"
BOTH_WAYS, ADJUSTING, WRITING = "tracking both ways", "adjusting", "writing results"
OTHER, TOTAL = "other", "total"
STAGES = (
    *(STARTING, RENDERING, ACTORS, FIRST_POSE, PREPARING, BACKGROUND, BEFORE),
    *(FIRST_FRAME, TRACKING, BOTH_WAYS, ADJUSTING, WRITING),
)
"""In the order in which they are shown."""
_SHOWN = 0.05
"""Seconds below which a stage is counted as `OTHER` in the table."""

Turn = Callable[[str], None]
"""Called with the name of a stage that takes the place of the one that runs."""


class Clock:
    """Seconds by stage, since the clock was made and `before`; a stage within another one counts for itself alone."""

    def __init__(self, before: float = 0.0):
        self._seconds, self._open = {STARTING: before}, [OTHER]
        self._since = time.perf_counter()

    def turn(self, stage: str) -> None:
        """End the stage that runs, and begin another one in its place."""
        now = time.perf_counter()
        self._seconds[self._open[-1]] = self._seconds.get(self._open[-1], 0.0) + now - self._since
        self._since, self._open[-1] = now, stage

    def begin(self, stage: str) -> None:
        """Begin a stage within the one that runs."""
        self.turn(self._open[-1])
        self._open.append(stage)

    def end(self) -> None:
        """End the stage that runs; the one around it goes on."""
        self.turn(OTHER)
        self._open.pop()

    def seconds(self) -> dict[str, float]:
        """Of every stage so far that took time; `OTHER` and the `TOTAL` come last."""
        self.turn(self._open[-1])
        found = {stage: self._seconds[stage] for stage in STAGES if self._seconds.get(stage)}
        total = sum(self._seconds.values())
        return found | {OTHER: total - sum(found.values()), TOTAL: total}

    def table(self) -> str:
        """A line for each stage that took time, to a tenth of a second, such that the lines add up to the total."""
        seconds = self.seconds()
        total, rest = seconds.pop(TOTAL), seconds.pop(OTHER)
        shown = {stage: value for stage, value in seconds.items() if value >= _SHOWN}
        rest += sum(value for stage, value in seconds.items() if stage not in shown)
        lines, so_far = [], 0.0
        for stage, value in (shown | {OTHER: rest}).items():
            tenths = round(10.0 * (so_far + value)) - round(10.0 * so_far)
            lines.append(f"{stage:<32}{0.1 * tenths:10.1f} s")
            so_far += value
        return "\n".join([*lines, f"{TOTAL:<32}{0.1 * round(10.0 * total):10.1f} s"])


_running: ContextVar[Clock | None] = ContextVar("_running", default=None)


@contextmanager
def clocked(before: float = 0.0) -> Iterator[Clock]:
    """The clock of what runs within the block: the one that runs already, else a new one, `before` seconds fast."""
    found = _running.get()
    if found is not None:
        yield found
        return
    clock = Clock(before)
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
    clock.begin(name)
    try:
        yield clock.turn
    finally:
        clock.end()


def seconds_so_far() -> dict[str, float]:
    """By stage, rounded for a file; empty where no clock runs."""
    clock = _running.get()
    return {} if clock is None else {name: round(value, 3) for name, value in clock.seconds().items()}


def age_of_process() -> float:
    """Seconds since this process began; 0 where the system does not say."""
    try:
        begun = int(Path("/proc/self/stat").read_text().rpartition(")")[2].split()[19]) / os.sysconf("SC_CLK_TCK")
        return max(time.clock_gettime(time.CLOCK_BOOTTIME) - begun, 0.0)
    except (OSError, ValueError, IndexError, AttributeError):
        return 0.0


Item = TypeVar("Item")

STEP_STAGES = {
    "decode": "waiting for decoded pictures",
    "cells": "averaging pictures to cells",
    "step": "tracking step",
    "outputs": "writing results",
    "whole": "decoding to pose, together",
}
WAITING = ("decode",)
"""Stages that only wait, so that their rate means nothing."""
LEAST_SHARE = 0.01
"""Share of the total time below which a stage gets no line."""


@dataclass
class StageTimes:
    """Seconds of every frame, by stage."""

    seconds: dict[str, array] = field(default_factory=dict)

    def timed(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """The items, noting how long each takes to arrive."""
        iterator = iter(items)
        while True:
            begin = time.perf_counter()
            try:
                item = next(iterator)
            except StopIteration:
                return
            self.add(stage, time.perf_counter() - begin)
            yield item

    def add(self, stage: str, seconds: float) -> None:
        """Note the time of one frame."""
        self.seconds.setdefault(stage, array("f")).append(seconds)

    def frames_per_second(self, stage: str, skipped: int = 1) -> float:
        """Rate of a stage without its first frames; NaN where there are no others."""
        rest = self.seconds.get(stage, array("f"))[skipped:]
        return len(rest) / sum(rest) if rest and sum(rest) > 0.0 else float("nan")

    def total(self, stage: str, skipped: int = 1) -> float:
        """Seconds of a stage without its first frames."""
        return float(sum(self.seconds.get(stage, array("f"))[skipped:]))

    def table(self) -> str:
        """A line per stage with its rate, or the seconds spent waiting; stages run beside each other."""
        lines, least = [], LEAST_SHARE * self.total("whole")
        for stage, text in STEP_STAGES.items():
            total, rate = self.total(stage), self.frames_per_second(stage)
            if total > least:
                lines.append(
                    f"{text:<32}{total:10.1f} s in all" if stage in WAITING else f"{text:<32}{rate:10.1f} frames/s"
                )
        return "\n".join(lines)
