"""A thread that passes things on: it never makes anybody wait, drops the oldest where it is slow, and counts that."""

from collections import deque
from collections.abc import Callable
from threading import Condition, Thread
from typing import Generic, TypeVar

from sogjax.errors import InputError
from sogjax.run.terminal import say

Item = TypeVar("Item")


class Outlet(Generic[Item]):
    """A `with` block in which a thread consumes what is put; at most `capacity` items wait.

    What goes wrong is said once, in a sentence, and nothing is consumed any more: whoever puts items goes on.
    """

    def __init__(self, name: str, consume: Callable[[Item], object], capacity: int) -> None:
        self.name, self.dropped, self.failed = name, 0, False
        self._consume, self._capacity = consume, capacity
        self._items: deque[Item] = deque()
        self._changed, self._ended = Condition(), False
        self._thread = Thread(target=self._run, name=name, daemon=True)

    def __enter__(self) -> "Outlet[Item]":
        self._thread.start()
        return self

    def put(self, item: Item) -> None:
        """Hand an item over; never waits."""
        with self._changed:
            if len(self._items) == self._capacity:
                self._items.popleft()
                self.dropped += 1
            self._items.append(item)
            self._changed.notify()

    def __exit__(self, *error: object) -> None:
        """Wait until what was put is consumed, unless that takes too long."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join(10.0)

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._items and not self._ended:
                    self._changed.wait()
                if not self._items:
                    return
                item = self._items.popleft()
            if self.failed:
                continue
            try:
                self._consume(item)
            except Exception as error:
                self.failed = True
                said = error if isinstance(error, (InputError, OSError)) else repr(error)
                say(f"{self.name}: stopped, the others go on: {said}")
