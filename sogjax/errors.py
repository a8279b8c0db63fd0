"""What a user did wrong, as one sentence with the place, the value and the remedy.

Words for sentences that people read.
"""


class InputError(ValueError):
    """Wrong input of a user; the command line prints it as one sentence and exits with status 2."""


def counted(count: int, noun: str, plural: str | None = None) -> str:
    """A number with its noun, such as `1 frame` or `2 frames`; `plural` where that is not the noun with an s."""
    return f"{count} {noun if count == 1 else plural or f'{noun}s'}"
