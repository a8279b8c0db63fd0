"""The program that makes the page on reliability: nearly every way in which an input can be wrong."""

import pytest
from bad_input_cases import cases
from fuzzing import fuzz_readers
from outcomes import outcomes_of

FAMILIES = sorted({case.family for case in cases()})


def test_there_are_many_cases():
    assert len(cases()) >= 60


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.slow
def test_wrong_input_is_refused_with_one_sentence_and_changes_nothing(family):
    outcomes = outcomes_of([case for case in cases() if case.family == family])
    assert [outcome for outcome in outcomes if not outcome.good] == []


@pytest.mark.slow
def test_damaged_files_never_end_in_a_traceback():
    assert {reader.name: reader.crashes for reader in fuzz_readers(60) if reader.crashes} == {}
