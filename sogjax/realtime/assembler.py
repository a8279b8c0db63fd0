"""The assembler: hands over the pictures of one moment together, or after half a frame those that are there.

It knows no clock and no threads: whoever calls it says what time it is.
"""

from collections import Counter, deque
from dataclasses import dataclass, field

from sogjax.realtime.pictures import FrameSet, Seen

GIVEN_UP = 10
"""Sets in a row without a camera, after which it is not waited for any more."""
MOST_OPEN = 4
"""Sets that wait for pictures, at most."""


@dataclass
class Assembler:
    """Puts pictures together by the time when they were taken; times are seconds.

    Of a camera that is too late for ten sets in a row the next ones do not wait, until it is in time again.
    """

    num_cameras: int
    period: float
    """From one frame to the next."""
    wait: float = 0.5
    """How long a set waits for late cameras, in periods."""
    late: Counter[int] = field(default_factory=Counter)
    """By camera, pictures that came after their set was handed over."""
    missing: Counter[int] = field(default_factory=Counter)
    """By camera, sets that were handed over without it."""
    last: Counter[int] = field(default_factory=Counter)
    """By camera, sets for which its picture came last."""

    def __post_init__(self) -> None:
        self._open: deque[FrameSet] = deque()
        self._absent: Counter[int] = Counter()
        self._done = float("-inf")

    @property
    def given_up(self) -> frozenset[int]:
        """Cameras that are not waited for."""
        return frozenset(camera for camera, count in self._absent.items() if count >= GIVEN_UP)

    def put(self, seen: Seen, now: float) -> list[FrameSet]:
        """Take a picture; the sets that are handed over now, in the order of their times."""
        if seen.exposed < self._done + 0.5 * self.period:
            self.late[seen.camera] += 1
            return self.due(now)
        found = next((each for each in self._open if abs(each.exposed - seen.exposed) < 0.5 * self.period), None)
        if found is not None and seen.camera in found.pictures:  # a camera that is faster than it should be
            found.pictures[seen.camera] = seen
            return self.due(now)
        if found is None:
            found = FrameSet(seen.exposed, seen.arrived)
            self._open.append(found)
            self._open = deque(sorted(self._open, key=lambda each: each.exposed))
        found.pictures[seen.camera] = seen
        found.arrived = min(found.arrived, seen.arrived)
        if len(found.pictures) == self.num_cameras:
            self.last[seen.camera] += 1
        return self.due(now)

    def due(self, now: float) -> list[FrameSet]:
        """The sets that wait no longer: complete, or old enough, or before one of these."""
        ready = [k for k, each in enumerate(self._open) if self._is_ready(each, now)]
        count = max([k + 1 for k in ready] + [len(self._open) - MOST_OPEN, 0])
        return [self._handed_over(now) for _ in range(count)]

    def deadline(self) -> float | None:
        """When `due` is to be asked again, if nothing comes before; None: nothing waits."""
        return min((each.arrived + self.wait * self.period for each in self._open), default=None)

    def _is_ready(self, each: FrameSet, now: float) -> bool:
        waited_for = set(range(self.num_cameras)) - self.given_up
        return waited_for <= each.pictures.keys() or now >= each.arrived + self.wait * self.period

    def _handed_over(self, now: float) -> FrameSet:
        found = self._open.popleft()
        found.handed_over, self._done = now, found.exposed
        for camera in range(self.num_cameras):
            if camera in found.pictures:
                self._absent[camera] = 0
            else:
                self._absent[camera] += 1
                self.missing[camera] += 1
        return found
