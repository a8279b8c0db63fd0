"""Rendered recordings of people with ground truth: for the demo, the tests and the benchmarks."""

from typing import TYPE_CHECKING, Any

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

_LAZY = {"render_recording": "render", "cached_recording": "cache", "default_cache_dir": "cache"}
"""Loaded on first use: the settings alone are needed by every command line."""


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)
