"""What the end of a sweep says of its members: in the table, the CSV and the picture."""

import csv

import cv2
import numpy as np
import pytest

from sogjax.cli.sweep import tables
from sogjax.cli.sweep.results import Failure, Member
from sogjax.cli.sweep.tables import finish_sweep
from sogjax.run.result import COLUMNS, Numbers
from sogjax.view.charts import bar_chart


def numbers(error_mm):
    return Numbers(dict.fromkeys(COLUMNS, 1.0) | {"mean mm": error_mm})


@pytest.fixture
def labels(monkeypatch):
    """What is written into the chart: titles and labels."""
    seen = []

    def drawn(panels, *, value):
        seen.extend((list(panel.rows), panel.title, list(panel.failed)) for panel in panels)
        return bar_chart(panels, value=value)

    monkeypatch.setattr(tables, "bar_chart", drawn)
    return seen


def rows_of(folder):
    with (folder / "sweep.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_values_with_spaces_are_whole(tmp_path, labels):
    words = ["recording='/a b/walk'", "recording='/a b/run fast'"]
    finish_sweep(tmp_path, [Member([word, "start=0"], numbers(10.0)) for word in words])
    assert labels == [(["'/a b/walk'", "'/a b/run fast'"], "mean marker error over recording", [])]
    assert [row["recording"] for row in rows_of(tmp_path)] == ["'/a b/walk'", "'/a b/run fast'"]


def test_a_key_that_is_taken_away_is_a_column(tmp_path, capsys, labels):
    finish_sweep(tmp_path, [Member(["~color", "stop=3"], numbers(10.0)), Member(["stop=4"], numbers(20.0))])
    assert labels == [(["taken away 3", "4"], "mean marker error over color, stop", [])]
    assert [row["color"] for row in rows_of(tmp_path)] == ["taken away", ""]
    assert "~color stop=3" in capsys.readouterr().out


def test_members_without_overrides_of_their_own_have_a_name(tmp_path, labels):
    finish_sweep(tmp_path, [Member([], numbers(10.0)), Member(["stop=4"], numbers(20.0))])
    assert labels == [(["as configured", "4"], "mean marker error over stop", [])]


def red_share(picture, number, count):
    """Of the pixels above a member's place, how many are red."""
    dark = (picture < 100).all(axis=2)
    first, last = np.flatnonzero(dark.mean(axis=0) > 0.5)[[0, -1]]  # the frame's left and right line
    left, right = (first + (last - first) * (number + k) / count for k in (0.0, 1.0))
    part = picture[:, int(left) + 1 : int(right)].astype(int)
    return np.mean(part[..., 2] - part[..., :2].max(axis=-1) > 60)


@pytest.mark.parametrize("count", [3, 40])
def test_a_failed_member_is_marked_and_one_without_truth_is_not(tmp_path, capsys, count):
    results = [Failure("the disk is full"), numbers(float("nan")), *(numbers(10.0) for _ in range(count - 2))]
    finish_sweep(tmp_path, [Member([f"stop={k}"], result) for k, result in enumerate(results)])
    picture = cv2.imread(str(tmp_path / "sweep.png"))
    shares = [red_share(picture, number, count) for number in range(3)]
    assert shares[0] > 0.0
    assert shares[1:] == [0.0, 0.0]
    assert rows_of(tmp_path)[0]["failed"] == "the disk is full"
    assert "stop=0" in capsys.readouterr().out


@pytest.mark.parametrize("truth", [True, False])
def test_what_columns_mean_is_said(tmp_path, capsys, labels, truth):
    error = 10.0 if truth else float("nan")
    finish_sweep(tmp_path, [Member([f"stop={k}"], Numbers(numbers(error) | {"findings": 2}), 3.0) for k in (3, 4)])
    out = capsys.readouterr().out
    assert "to first mm: mean distance of the joints" in out
    assert ("no truth: these numbers compare" in out) == (not truth)
    assert " 2 " in out.splitlines()[1] + " "
