"""Files that are read whole, and refused if they are larger than their kind can be."""

from pathlib import Path

from sogjax.errors import InputError


def read_bounded(path: Path, max_bytes: int) -> bytes:
    """The content of a file.

    Raises:
        InputError: it cannot be read, or has more than `max_bytes`.
    """
    try:
        with path.open("rb") as file:
            content = file.read(max_bytes + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); check the path") from error
    if len(content) > max_bytes:
        raise InputError(f"{path}: is larger than {max_bytes} bytes; give a file of the right kind")
    return content
