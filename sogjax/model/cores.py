"""The processor's cores: how many there are, and what is done on all of them."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from threading import Event, local
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
_here = local()
"""In a thread of `in_threads`: `left`, the event of its caller having left."""


def usable_cores() -> int:
    """How many processor cores this process may use, which can be fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_threads(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    most: int | None = None,
    watched: Callable[[Iterator[Result]], Iterable[Result]] = iter,
) -> list[Result]:
    """What a function makes of each item, with a thread for each core, or `most`: jax and OpenCV work beside Python.

    Within one of these threads items are taken in order. After an error, or Ctrl-C, those begun end first: where that
    takes long, the function calls `go_on`. What is made passes through `watched` as it comes, in order.
    """
    given = [*items]
    threads = min(len(given), usable_cores(), most or len(given))
    if threads < 2 or hasattr(_here, "left"):
        return [*watched(map(function, given))]
    left = Event()

    def of_item(item: Item) -> Result:
        _here.left = left
        return function(item)

    with ThreadPoolExecutor(threads) as pool:
        try:
            return [*watched(pool.map(of_item, given))]
        except BaseException:
            left.set()
            raise


def go_on() -> None:
    """Go on, unless what is done here is no longer wanted.

    Raises:
        CancelledError: who called `in_threads` has left.
    """
    if hasattr(_here, "left") and _here.left.is_set():
        raise CancelledError
