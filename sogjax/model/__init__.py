"""The nouns: Sums of Gaussians, colours, cameras, skeletons, bodies."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.model.body import Body
    from sogjax.model.camera import Camera, project
    from sogjax.model.skeleton import Skeleton
    from sogjax.model.sog import Sog

__all__ = [
    "Body",
    "Camera",
    "Skeleton",
    "Sog",
    "project",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "Body": "sogjax.model.body",
        "Camera": "sogjax.model.camera",
        "Skeleton": "sogjax.model.skeleton",
        "Sog": "sogjax.model.sog",
        "project": "sogjax.model.camera",
    },
)
