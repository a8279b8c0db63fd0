"""Compiled programs are forgotten before there are more of them than a process may hold.

Each takes some memory maps, of which Linux allows a process 65530 by default; a process that has used them up does not
get an error that could be caught, but ends. A study or sweep of many settings that each need a program gets there.
"""

import gc
from pathlib import Path

import jax

FULL = 0.4
"""Share of the maps that are allowed, from which on programs are forgotten; one run may need a tenth."""
_MAPS, _MOST = Path("/proc/self/maps"), Path("/proc/sys/vm/max_map_count")


def forget_programs_if_many(maps: Path = _MAPS, most: Path = _MOST) -> bool:
    """Forget all compiled programs where the process has used up many of its maps; whether that was so.

    They are compiled again when they are needed. Where the system does not tell, nothing is done.
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
