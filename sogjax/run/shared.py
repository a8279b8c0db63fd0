"""Records that runs of one process share: the members of a sweep, and the runs of a study."""

from collections.abc import Callable
from threading import RLock
from typing import Any, TypeVar

Record = TypeVar("Record")


class SharedRecords:
    """Records by what they depend on; those that were asked for longest ago are dropped.

    Args:
        most: records that are held. Backgrounds of twelve cameras take 30 MB, all others next to nothing.
    """

    def __init__(self, most: int = 6):
        self._records: dict[str, Any] = {}
        self._most, self._lock = most, RLock()

    def get(self, key: str, make: Callable[[], Record]) -> Record:
        """The record of a key, made now if it is not held; one at a time, as making takes all cores."""
        with self._lock:
            if key not in self._records:
                self._records[key] = make()
            self._records[key] = self._records.pop(key)  # the last one now
            for oldest in list(self._records)[: -self._most]:
                del self._records[oldest]
            return self._records[key]

    def forget(self) -> None:
        """Drop all records: files may change between sweeps."""
        with self._lock:
            self._records.clear()


SHARED = SharedRecords()
"""The records of this process."""
