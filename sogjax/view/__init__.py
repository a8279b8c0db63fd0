"""Pictures and Rerun files that show whether a motion can be trusted."""

from typing import TYPE_CHECKING

from sogjax.lazy import lazy_names

if TYPE_CHECKING:
    from sogjax.view.rerun.comparison import write_comparison
    from sogjax.view.rerun.iterations import write_iterations

__all__ = [
    "write_comparison",
    "write_iterations",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "write_comparison": "sogjax.view.rerun.comparison",
        "write_iterations": "sogjax.view.rerun.iterations",
    },
)
