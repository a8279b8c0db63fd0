"""The memory of a process: how much may be taken, what was freed goes back, and compiled programs are dropped in time.

Each program takes some memory maps, of which Linux allows a process 65530 by default. A process that runs out of them
is ended without an error that could be caught. Studies and sweeps over many settings can get that far, and before that
their programs may take more memory than a machine has to spare.
"""

import ctypes
import gc
import os
import sys
from pathlib import Path

from sogjax.model.program import forget_programs

FULL = 0.4
"""Share of the allowed maps above which programs are dropped; one run may need a tenth."""
MANY, LARGE = 0.1, 0.15
"""Share of the allowed maps above which they are dropped if the process has this share of the machine's memory."""
_MAPS, _MOST = Path("/proc/self/maps"), Path("/proc/sys/vm/max_map_count")


def forget_programs_if_many(maps: Path = _MAPS, most: Path = _MOST, memory: float | None = None) -> bool:
    """Drop all compiled programs if the process has used many of its memory maps; returns whether it did.

    They are compiled again when needed. Does nothing where the system does not report its maps.

    Args:
        maps: the file that lists them.
        most: the file with how many are allowed.
        memory: the process's share of the machine's memory; None: as the system reports it.
    """
    try:
        with maps.open("rb") as lines:
            used = sum(1 for _ in lines)
        allowed = int(most.read_text())
    except (OSError, ValueError):
        return False
    memory = _memory_share() if memory is None else memory
    if used < (MANY if memory > LARGE else FULL) * allowed:
        return False
    forget_programs()
    gc.collect()
    return True


def _memory_share() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages / os.sysconf("SC_PHYS_PAGES")


def return_freed_memory() -> None:
    """Give freed memory back to the system, where the C library can (glibc's malloc_trim takes some 40 ms).

    Otherwise each program of a process that compiles several needs its memory beside what the earlier ones left.
    """
    if not sys.platform.startswith("linux"):
        return
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except (OSError, AttributeError):
        return
    trim(0)


_MEMORY = Path("/proc/meminfo")


def available_memory(report: Path = _MEMORY) -> int | None:
    """The bytes that can be taken without swapping; None where the system does not say.

    What the system holds of files, to be given up when asked for, counts as available where `report` tells it.
    """
    try:
        for line in report.read_text().splitlines():
            name, _, amount = line.partition(":")
            if name == "MemAvailable":
                return 1024 * int(amount.split()[0])
    except (OSError, ValueError, IndexError):
        pass
    try:
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, AttributeError):
        return None
