"""The clip as a whole: poses of all frames, the shape of the body, and cameras (bundle adjustment)."""

from sogjax.adjust.adjustment import Adjusted, adjusted
from sogjax.adjust.clip_energy import Weights
from sogjax.adjust.clip_shape import ClipShape

__all__ = ["Adjusted", "ClipShape", "Weights", "adjusted"]
