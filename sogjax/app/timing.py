"""How long the stages of a run take, the first frames (which compile) apart."""

import time
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import TypeVar

Item = TypeVar("Item")


@dataclass
class StageTimes:
    """Seconds of every frame, by stage."""

    seconds: dict[str, array] = field(default_factory=dict)

    def timed(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """The items; the time that each takes to come is noted."""
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

    def first(self, stage: str) -> float:
        """Seconds of the first frame, which compiles."""
        return self.seconds.get(stage, array("f", [float("nan")]))[0]
