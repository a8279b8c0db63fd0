"""Stages of work in threads of their own, joined by bounded queues: a slow stage makes the others wait."""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from threading import Condition, Thread
from types import TracebackType
from typing import Generic, TypeVar

Item = TypeVar("Item")


class Channel(Generic[Item]):
    """A queue between two threads, with room for a few items, that either side can end."""

    def __init__(self, room: int):
        self._items: deque[Item] = deque()
        self._room = room
        self._changed = Condition()
        self._finished = self._closed = False
        self._error: BaseException | None = None

    def put(self, item: Item) -> bool:
        """Append an item as soon as there is room; False if no one takes items any more."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or len(self._items) < self._room)
            if not self._closed:
                self._items.append(item)
                self._changed.notify_all()
            return not self._closed

    def finish(self, error: BaseException | None = None) -> None:
        """There is nothing more to put; an error is raised where the items are taken, after the last one."""
        with self._changed:
            self._finished, self._error = True, error
            self._changed.notify_all()

    def close(self) -> None:
        """Nothing more is taken; what is still here is dropped."""
        with self._changed:
            self._closed = True
            self._items.clear()
            self._changed.notify_all()

    def __iter__(self) -> Iterator[Item]:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._items) or self._finished)
                if not self._items:
                    if self._error is not None:
                        raise self._error
                    return
                item = self._items.popleft()
                self._changed.notify_all()
            yield item


def prefetch(items: Iterable[Item], room: int) -> Generator[Item, None, None]:
    """The items, made by a thread that is up to `room` of them ahead; it ends when the iterator does or is closed."""
    channel: Channel[Item] = Channel(room)
    thread = Thread(target=_fill, args=(channel, items), name="ahead", daemon=True)
    thread.start()
    try:
        yield from channel
    finally:
        channel.close()
        thread.join()


def _fill(channel: Channel[Item], items: Iterable[Item]) -> None:
    iterator = iter(items)
    error: BaseException | None = None
    try:
        for item in iterator:
            if not channel.put(item):
                break
    except BaseException as raised:  # told to the thread that takes the items
        error = raised
    finally:
        close = getattr(iterator, "close", None)
        if close is not None:
            close()
        channel.finish(error)


class Writer(Generic[Item]):
    """A `with` block whose items a thread consumes; at most `room` of them wait.

    At the end of the block everything that was put has been consumed, also when the block was left by an error. An
    error of the consumer is raised by the next `put`, or at the end.
    """

    def __init__(self, consume: Callable[[Iterator[Item]], None], room: int):
        self._consume = consume
        self._channel: Channel[Item] = Channel(room)
        self._error: BaseException | None = None
        self._thread = Thread(target=self._run, name="behind", daemon=True)

    def __enter__(self) -> "Writer[Item]":
        self._thread.start()
        return self

    def put(self, item: Item) -> None:
        """Hand an item over; waits until there is room."""
        if not self._channel.put(item):
            self._raise()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._channel.finish()
        self._thread.join()
        if error is None:
            self._raise()

    def _raise(self) -> None:
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        try:
            self._consume(iter(self._channel))
        except BaseException as error:  # told to the thread that puts the items
            self._error = error
        finally:
            self._channel.close()
