"""Numbers and their nouns."""

import pytest

from sogjax.errors import counted


@pytest.mark.parametrize(("count", "words"), [(0, "0 frames"), (1, "1 frame"), (2, "2 frames")])
def test_only_one_is_singular(count, words):
    assert counted(count, "frame") == words


def test_a_noun_with_a_plural_of_its_own():
    assert [counted(k, "degree of freedom", "degrees of freedom") for k in (1, 2)] == [
        "1 degree of freedom",
        "2 degrees of freedom",
    ]
