"""Reading and writing: recordings, calibrations, videos, actors, motions."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.data.motion import motion_from_poses
    from sogjax.data.video import read_frames

__all__ = [
    "motion_from_poses",
    "read_frames",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "motion_from_poses": "sogjax.data.motion",
        "read_frames": "sogjax.data.video",
    },
)
