"""From example poses to an actor (Section 5.2)."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.actor.make import MadeActor
    from sogjax.actor.report import actor_report

__all__ = [
    "MadeActor",
    "actor_report",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "MadeActor": "sogjax.actor.make",
        "actor_report": "sogjax.actor.report",
    },
)
