"""How much memory a process may still take."""

import os
from pathlib import Path

_MEMORY = Path("/proc/meminfo")


def available_memory(report: Path = _MEMORY) -> int | None:
    """Bytes that can be taken without swapping; None where the system does not say.

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
