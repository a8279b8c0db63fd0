"""Writing motions in the formats of other programs: one writer a format, chosen by the file's ending."""

from collections.abc import Callable
from pathlib import Path

from sogjax.data.export.bvh import write_bvh
from sogjax.data.motion import Motion, save_motion
from sogjax.errors import InputError

__all__ = ["WRITERS", "export_motion", "write_bvh"]

WRITERS: dict[str, Callable[[Path, Motion, str], None]] = {
    ".bvh": write_bvh,
    ".npz": lambda path, motion, up: save_motion(path, motion),
}
"""By file ending: a function of the path, the motion, and the vertical of the motion's world."""


def export_motion(motion: Motion, path: Path, up: str = "z") -> None:
    """Write `motion`, whose world has the vertical `up`, in the format that the ending of `path` names.

    Raises:
        InputError: an ending that no writer knows, or what the writer refuses.
    """
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        known = " ".join(sorted(WRITERS))
        raise InputError(f"{path}: no writer for the ending {path.suffix!r}; use one of: {known}")
    writer(path, motion, up)
