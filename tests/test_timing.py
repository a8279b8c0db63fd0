"""The table of times: rates of work, seconds of waiting, and no line for what takes no time."""

import pytest

from sogjax.run.clock import StageTimes


def times(**seconds):
    """Four frames of each stage, whose first one is left out; `whole` as it would be."""
    found = StageTimes()
    for stage, each in (seconds | {"whole": sum(seconds.values())}).items():
        for frame in range(4):
            found.add(stage, each + 10.0 * (frame == 0))
    return found


def rows(found):
    return {line[:32].strip(): line[32:].split() for line in found.table().splitlines()}


def test_work_is_a_rate_and_waiting_is_seconds():
    found = rows(times(decode=0.5, step=0.25))
    assert found["tracking step"] == ["4.0", "frames/s"]
    assert found["decoding to pose, together"] == ["1.3", "frames/s"]
    assert found["waiting for decoded pictures"] == ["1.5", "s", "in", "all"]


@pytest.mark.parametrize("stage", ["decode", "cells"])
def test_a_stage_that_takes_no_time_has_no_line(stage):
    found = rows(times(**{stage: 2e-5, "step": 0.25}))
    assert list(found) == ["tracking step", "decoding to pose, together"]


def test_without_a_second_frame_there_are_no_rates():
    found = StageTimes()
    assert found.table() == ""
    for stage in ("decode", "step", "whole"):
        found.add(stage, 2.0)
    assert found.table() == ""
