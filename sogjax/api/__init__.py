"""What `import sogjax` offers: the work of the commands as functions, which write no files unless told to."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.api.actors import fit_actor

__all__ = [
    "fit_actor",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "fit_actor": "sogjax.api.actors",
    },
)
