"""Motions in Rerun; every call of Rerun in this project stands in this folder."""

from sogjax.view.rerun.comparison import write_comparison
from sogjax.view.rerun.file import ImageBlobs, RerunFile, view_command, write_rerun
from sogjax.view.rerun.iterations import write_iterations

__all__ = ["ImageBlobs", "RerunFile", "view_command", "write_comparison", "write_iterations", "write_rerun"]
