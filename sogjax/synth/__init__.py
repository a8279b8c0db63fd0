"""Rendered recordings of people with ground truth: for the demo, the tests and the benchmarks."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names
from sogjax.synth.settings import ACTOR_NAMES, MOTIONS, SynthSettings

if TYPE_CHECKING:
    from sogjax.synth.cache import cached_recording, default_cache_dir
    from sogjax.synth.render import render_recording

__all__ = [
    "ACTOR_NAMES",
    "MOTIONS",
    "SynthSettings",
    "cached_recording",
    "default_cache_dir",
    "render_recording",
]

# Loaded on first use: the settings alone are needed by every command line.
__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "render_recording": f"{__name__}.render",
        "cached_recording": f"{__name__}.cache",
        "default_cache_dir": f"{__name__}.cache",
    },
)
