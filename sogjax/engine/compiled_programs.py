"""Compiled programs are dropped before a process holds more of them than it may.

Each program takes some memory maps, of which Linux allows a process 65530 by default. A process that runs out of them
is ended without an error that could be caught. Studies and sweeps over many settings can get that far.
"""

import gc
from pathlib import Path

import jax

FULL = 0.4
"""Share of the allowed maps above which programs are dropped; one run may need a tenth."""
_MAPS, _MOST = Path("/proc/self/maps"), Path("/proc/sys/vm/max_map_count")


def forget_programs_if_many(maps: Path = _MAPS, most: Path = _MOST) -> bool:
    """Drop all compiled programs if the process has used many of its memory maps; returns whether it did.

    They are compiled again when needed. Does nothing where the system does not report its maps.
    """
    try:
        with maps.open("rb") as lines:
            used = sum(1 for _ in lines)
        allowed = int(most.read_text())
    except (OSError, ValueError):
        return False
    if used < FULL * allowed:
        return False
    jax.clear_caches()
    gc.collect()
    return True
