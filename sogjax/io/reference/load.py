"""The register of readers of other systems' motions."""

from collections.abc import Callable
from pathlib import Path

from sogjax.io.reference.bvh import read_bvh
from sogjax.io.reference.c3d import read_c3d
from sogjax.io.reference.reference_motion import ReferenceMotion
from sogjax.io.reference.tables import read_mot, read_trc

READERS: dict[str, Callable[[Path], ReferenceMotion]] = {
    **{".mot": read_mot, ".sto": read_mot, ".trc": read_trc, ".c3d": read_c3d, ".bvh": read_bvh},
}
"""What reads another system's motion, by the file's ending."""


def is_reference(path: Path) -> bool:
    """Whether a file is another system's motion, by its ending."""
    return path.suffix.lower() in READERS


def load_reference(path: Path) -> ReferenceMotion:
    """The motion of another system.

    Raises:
        InputError: the file is missing, of another kind than its ending says, or damaged.
    """
    return READERS[path.suffix.lower()](path)
