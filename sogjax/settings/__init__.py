"""Settings with their defaults, help texts and presets, as plain dataclasses; nothing here needs Hydra."""
