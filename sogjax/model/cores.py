"""The processor's cores: how many there are, and what is done on all of them."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import CancelledError, ThreadPoolExecutor
from threading import Event, local
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")
_here = local()
"""In a thread of `in_threads`: `left`, the events of its callers having left, and how many `cores` are its share."""


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

    Within one of these threads, others have its share of the cores. After an error, or Ctrl-C, items that were begun
    end first: where that takes long, the function calls `go_on`. What is made passes through `watched` as it comes, in
    order.
    """
    given, cores = [*items], getattr(_here, "cores", None) or usable_cores()
    threads, outer = min(len(given), cores, most or len(given)), getattr(_here, "left", ())

    def of_next(item: Item) -> Result:
        go_on()
        return function(item)

    if threads < 2:
        return [*watched(map(of_next, given))]
    left = Event()

    def of_item(item: Item) -> Result:
        _here.left, _here.cores = (*outer, left), max(cores // threads, 1)
        return of_next(item)

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
    if any(left.is_set() for left in getattr(_here, "left", ())):
        raise CancelledError
