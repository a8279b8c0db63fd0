"""Texts damaged at random, as hypothesis draws them."""

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

FUZZ = settings(max_examples=300, deadline=5000, suppress_health_check=list(HealthCheck))

WORDS = (
    "",
    "nan",
    "-inf",
    "1e999",
    "9" * 5000,
    "{",
    "}",
    "[",
    "]",
    '"',
    "<",
    ">",
    "\n",
    "\0",
    "é",
    "- ",
    ":",
    "=",
    " ",
)
"""What parsers stumble over."""


def damaged(text):
    """The text with up to four pieces cut out, doubled, or replaced."""
    piece = st.tuples(st.integers(0, len(text)), st.integers(0, 40), st.sampled_from(WORDS), st.booleans())

    def changed(pieces):
        result = text
        for start, length, word, again in pieces:
            part = result[start : start + length]
            result = result[:start] + (part + word + part if again else word) + result[start + length :]
        return result

    return st.lists(piece, min_size=1, max_size=4).map(changed)
