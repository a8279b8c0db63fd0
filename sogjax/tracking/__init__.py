"""From frame to frame (Section 5.3)."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.tracking.iterations import best_after
    from sogjax.tracking.scales import pose_scales

__all__ = [
    "best_after",
    "pose_scales",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "best_after": "sogjax.tracking.iterations",
        "pose_scales": "sogjax.tracking.scales",
    },
)
