"""The members of a sweep, which are looked at before it begins."""

import pytest
from command_line import refused
from hydra.core.override_parser.overrides_parser import OverridesParser

from sogjax.cli.sweep.run import members_of


def members(*words):
    return list(members_of(OverridesParser.create().parse_overrides(list(words))))


def test_the_last_override_varies_fastest():
    assert members("a=1,2", "b=x", "c=3,4") == [(f"a={a}", "b=x", f"c={c}") for a in (1, 2) for c in (3, 4)]


def test_a_word_given_twice_counts_once_as_its_last():
    assert members("a=1,2", "b=x,y", "a=7") == [("a=7", "b=x"), ("a=7", "b=y")]


def test_lists_and_quoted_commas_are_one_value():
    assert members("a=[1,2],[3]", "b='x,y'") == [("a=[1,2]", "b='x,y'"), ("a=[3]", "b='x,y'")]


@pytest.mark.parametrize(
    ("values", "why"), [("interval(0,1)", "energy.limit_weight=interval(0,1): name the values"), ("1,range(2,4)", "")]
)
def test_what_is_no_list_of_values_is_refused(capsys, values, why):
    assert why in refused(capsys, "track", "-m", "recording=x", f"energy.limit_weight={values}")


@pytest.mark.parametrize("word", ["a=range(0,3)", "a=choice(0,1,2)", "a=0,1,2"])
def test_every_way_to_list_values(word):
    assert members(word) == [("a=0",), ("a=1",), ("a=2",)]
