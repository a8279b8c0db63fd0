"""How fast the stages of tracking are that run beside each other, without the first frames, which compile."""

import time
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

Item = TypeVar("Item")

STAGES = {
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
        for stage, text in STAGES.items():
            total, rate = self.total(stage), self.frames_per_second(stage)
            if total > least:
                lines.append(
                    f"{text:<32}{total:10.1f} s in all" if stage in WAITING else f"{text:<32}{rate:10.1f} frames/s"
                )
        return "\n".join(lines)
