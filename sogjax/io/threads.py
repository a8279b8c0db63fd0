"""Stages of work in threads of their own with few items between them: a slow stage makes the others wait."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from queue import Queue
from threading import Thread
from types import TracebackType
from typing import Any, Generic, TypeVar

Item = TypeVar("Item")

_END: Any = object()


def prefetch(items: Iterable[Item], capacity: int) -> Generator[Item, None, None]:
    """The items, made by a thread: one is in the making while up to `capacity` wait.

    The thread ends, and closes `items`, when this iterator ends or is closed. An error is raised after the items
    before it.
    """
    iterator = iter(items)
    with ThreadPoolExecutor(1, "prefetch") as thread:
        ahead = deque(thread.submit(next, iterator, _END) for _ in range(capacity + 1))
        try:
            while (item := ahead.popleft().result()) is not _END:
                ahead.append(thread.submit(next, iterator, _END))
                yield item
        finally:
            for made in ahead:
                made.cancel()
            thread.submit(getattr(iterator, "close", lambda: None)).result()


class Writer(Generic[Item]):
    """A `with` block whose items a thread consumes; at most `capacity` of them wait.

    At the end of the block everything that was put has been consumed, also when the block was left by an error. An
    error of the consumer is raised by the next `put`, or at the end.
    """

    def __init__(self, consume: Callable[[Iterator[Item]], None], capacity: int):
        self._consume = consume
        self._items: Queue[Item] = Queue(capacity)
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, name="writer", daemon=True)

    def __enter__(self) -> "Writer[Item]":
        self._thread.start()
        return self

    def put(self, item: Item) -> None:
        """Hand an item over; waits until there is room."""
        self._raise()
        self._items.put(item)
        self._raise()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._items.put(_END)
        self._thread.join()
        if error is None:
            self._raise()

    def _raise(self) -> None:
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        items = iter(self._items.get, _END)
        try:
            self._consume(items)
        except BaseException as error:  # told to the thread that puts the items
            self._error = error
        for _ in items:
            pass  # whoever puts an item must not wait for ever
