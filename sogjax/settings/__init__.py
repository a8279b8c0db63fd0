"""Settings with their defaults, help texts and presets, as plain dataclasses; nothing here needs Hydra."""

from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig, SolverConfig, TrackingConfig
from sogjax.settings.run import ActorConfig, AdjustConfig, OutputsConfig, TrackConfig

__all__ = [
    "ActorConfig",
    "AdjustConfig",
    "ColorConfig",
    "EnergyConfig",
    "ImagesConfig",
    "OutputsConfig",
    "SolverConfig",
    "TrackConfig",
    "TrackingConfig",
]
