"""Writing motions in the formats of other programs: one writer per format, chosen by the file's extension."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.export.angles import write_mot
from sogjax.io.export.bvh import write_bvh
from sogjax.io.export.glb import write_glb
from sogjax.io.export.points import write_c3d, write_csv, write_trc
from sogjax.io.motion_data import MotionData, save_motion

WRITERS: dict[str, Callable[[Path, MotionData, str], None]] = {
    ".bvh": write_bvh,
    ".c3d": write_c3d,
    ".csv": write_csv,
    ".glb": write_glb,
    ".mot": write_mot,
    ".npz": lambda path, motion, up: save_motion(path, replace(motion, up=up)),
    ".trc": write_trc,
}
"""By file ending: a function of the path, the motion, and the vertical of the motion's world."""


def motion_writer(path: Path) -> Callable[[Path, MotionData, str], None]:
    """What writes a motion in the format that the ending of `path` names.

    Raises:
        InputError: an ending that no writer knows.
    """
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        known = " ".join(sorted(WRITERS))
        raise InputError(f"{path}: no writer for the extension {path.suffix!r}; use one of: {known}")
    return writer


def export_motion(motion: MotionData, path: Path, up: str | None = None) -> None:
    """Write `motion` in the format that the ending of `path` names.

    `up` is the vertical of the motion's world, where it is not what the motion says.

    Raises:
        InputError: an ending that no writer knows, or what the writer refuses.
    """
    motion_writer(path)(path, motion, up or motion.up)
