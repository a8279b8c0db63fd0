"""What a user did wrong, as one sentence with the place, the value and the remedy.

Words for sentences that people read.
"""

from collections.abc import Iterable


class InputError(ValueError):
    """Wrong input of a user; the command line prints it as one sentence and exits with status 2."""


def counted(count: int, noun: str, plural: str | None = None) -> str:
    """A number with its noun, such as `1 frame` or `2 frames`; `plural` where that is not the noun with an s."""
    return f"{count} {noun if count == 1 else plural or f'{noun}s'}"


def listed(names: Iterable[str], most: int = 6) -> str:
    """Names for a sentence, shortened if there are many."""
    names = list(names)
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
