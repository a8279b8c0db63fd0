"""Where what can be made again is kept between runs: rendered recordings, compiled programs."""

import os
from pathlib import Path

VARIABLE = "SOGJAX_CACHE"
"""The environment variable that names another folder."""


def default_cache_dir() -> Path:
    """The folder that SOGJAX_CACHE names, else one in the system's folder for caches."""
    own = os.environ.get(VARIABLE)
    if own:
        return Path(own)
    system = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    return Path(system) / "sogjax" if system else Path.home() / ".cache" / "sogjax"
