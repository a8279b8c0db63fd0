"""The slot between the cameras and the tracker: it holds one set; the latest wins, what it replaces is counted."""

import time
from collections.abc import Callable
from threading import Condition

from sogjax.realtime.assembler import Assembler
from sogjax.realtime.pictures import FrameSet, Seen


class Slot:
    """Takes pictures from the cameras' threads, and gives the tracker the latest set.

    Sets whose time is over are handed over when the tracker asks: no thread has to watch them. `on_set` is called with
    every set that is handed over, those that are overwritten too, and must be quick.
    """

    def __init__(self, assembler: Assembler, on_set: Callable[[FrameSet], object] = lambda _: None) -> None:
        self.assembler, self.overwritten, self.handed_over = assembler, 0, 0
        self._on_set, self._latest = on_set, None
        self._changed, self._ended = Condition(), False
        self._error: BaseException | None = None

    def put(self, seen: Seen) -> None:
        """Take a camera's picture; never waits for the tracker."""
        with self._changed:
            self._keep(self.assembler.put(seen, time.monotonic()))
            self._changed.notify()

    def end(self, error: BaseException | None = None) -> None:
        """No more pictures come, perhaps because of an error, which `take` raises."""
        with self._changed:
            self._ended, self._error = True, error
            self._changed.notify()

    def take(self, timeout: float) -> FrameSet | None:
        """The latest set, waited for; None: none came in so many seconds, or no more come.

        Raises:
            InputError: what kept the cameras from going on.
        """
        stop = time.monotonic() + timeout
        with self._changed:
            while True:
                now = time.monotonic()
                self._keep(self.assembler.due(now))
                if self._latest is not None:
                    found, self._latest = self._latest, None
                    return found
                if self._error is not None:
                    raise self._error
                if (self._ended and self.assembler.deadline() is None) or now >= stop:
                    return None
                deadline = self.assembler.deadline()
                self._changed.wait(max(min(stop if deadline is None else deadline, stop) - now, 1e-4))

    @property
    def ended(self) -> bool:
        """Whether nothing more comes."""
        with self._changed:
            return self._ended and self._latest is None and self.assembler.deadline() is None

    def _keep(self, sets: list[FrameSet]) -> None:
        for each in sets:
            self.handed_over += 1
            self.overwritten += self._latest is not None
            self._latest = each
            self._on_set(each)
