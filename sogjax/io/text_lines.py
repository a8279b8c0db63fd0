"""Text files of lines and words, read line by line; errors give the number of their line."""

from collections.abc import Sequence
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.files import read_text

LARGEST = 1e9
"""No such file holds a larger number."""


class Lines:
    """The lines of a file that are not empty, as words, up to a line that begins with `until`.

    The characters of `own_line` stand on lines of their own, wherever they are.

    Raises:
        InputError: the file cannot be read, has more than `max_bytes` or is no text.
    """

    def __init__(self, path: Path, max_bytes: int, own_line: str = "", until: str | None = None):
        self.path = path
        text = read_text(path, max_bytes)
        if until is not None:
            text = text.partition(f"\n{until}")[0]
        self._rows: list[tuple[int, str]] = []
        for number, line in enumerate(text.splitlines(), 1):
            for character in own_line:
                line = line.replace(character, f"\n{character}\n")
            self._rows += [(number, part) for part in line.split("\n") if part.strip()]
        self._next = 0

    @property
    def left(self) -> int:
        """How many lines are left."""
        return len(self._rows) - self._next

    def peek(self) -> list[str]:
        """The words of the next line, which stays; none at the end."""
        return self._rows[self._next][1].split() if self.left else []

    def take(self, expected: str, counts: Sequence[int] = ()) -> list[str]:
        """The words of the next line, as many as one of `counts` says.

        Raises:
            InputError: the file ends, or the line has another number of words.
        """
        if not self.left:
            raise InputError(f"{self.path}: ends where {expected} is expected; is the file whole?")
        self._next += 1
        words = self._rows[self._next - 1][1].split()
        if counts and len(words) not in counts:
            raise self.error(expected)
        return words

    def error(self, expected: str) -> InputError:
        """The complaint that the line taken last is not what was expected."""
        number, line = self._rows[self._next - 1]
        text = " ".join(line.split())
        shown = text if len(text) <= 60 else f"{text[:57]}..."
        return InputError(f"{self.path}: line {number} is {shown!r}, expected {expected}")

    def number(self, word: str, expected: str = "a finite number") -> float:
        """A number of the line taken last."""
        try:
            value = float(word)
        except ValueError:
            raise self.error(expected) from None
        if not abs(value) <= LARGEST:
            raise self.error(expected)
        return value

    def numbers(self, words: Sequence[str], expected: str = "finite numbers") -> list[float]:
        """Numbers of the line taken last."""
        return [self.number(word, expected) for word in words]

    def count(self, word: str, at_most: int) -> int:
        """How many lines follow: never more than there are, nor than `at_most`."""
        expected = f"a whole number of at most {min(at_most, self.left)} (as many lines may follow)"
        value = self.number(word, expected)
        if value != round(value) or not 0 <= value <= min(at_most, self.left):
            raise self.error(expected)
        return int(value)
