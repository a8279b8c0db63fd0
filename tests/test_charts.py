"""Charts of studies: lines have names, and no marker is cut."""

import cv2
import numpy as np
import pytest

from sogjax.view import charts
from sogjax.view.charts import Bars, Means, bar_chart, mean_chart


def pixels(content):
    """A chart's pixels, BGR."""
    return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR).astype(int)


def drawn(paper=None, count=1, **more):
    panel = Means(["a", "b"], [20.0, 22.0], [(19.0, 21.0), (21.0, 23.0)], **more)
    return pixels(mean_chart([panel] * count, axis="x", value="mm", paper=paper))


def beside(picture):
    """How many columns right of the panel's frame have ink."""
    dark = (picture < 130).all(axis=2)
    frame = np.flatnonzero(dark.mean(axis=0) > 0.5).max()
    return int(dark[:, frame + 1 :].any(axis=0).sum())


def test_lines_are_named_right_of_the_panel():
    members = {"walk": [18.0, 21.0], "squat": [22.0, float("nan")], "nothing": [float("nan")] * 2}
    assert beside(drawn()) < 5
    assert beside(drawn(members=members)) > 10
    assert beside(drawn(members={"nothing": [float("nan")] * 2})) < 5


def test_the_top_marker_of_the_papers_panel_is_whole(monkeypatch):
    monkeypatch.setattr(charts, "REFERENCE", "#ff00ff")
    picture = drawn(paper={"a": 43.0, "b": 44.0})
    rows, columns = np.nonzero((np.abs(picture - [255, 0, 255]) < 40).all(axis=2))
    right = columns > columns.max() - 4  # within the square at the right end, which is the top one
    left = columns < columns.min() + 4
    assert np.ptp(rows[right]) == np.ptp(rows[left])


def test_each_method_has_a_panel_of_its_own(monkeypatch):
    monkeypatch.setattr(charts, "INK", "#ff00ff")
    inked = [(np.abs(drawn(count=count) - [255, 0, 255]) < 40).all(axis=2).sum() for count in (1, 2)]
    assert inked[1] > 1.8 * inked[0] > 0


def test_a_higher_bar_is_drawn_higher():
    picture = pixels(bar_chart([Bars("x", ["a", "b", "c"], {"": [50.0, np.nan, 100.0]})], value="mm"))
    bars = np.argwhere((np.abs(picture - [180, 119, 31]) < 3).all(axis=2))
    columns = np.unique(bars[:, 1])
    heights = [(bars[:, 1] == column).sum() for column in (columns[2], columns[-3])]
    assert heights[0] / heights[1] == pytest.approx(0.5, abs=0.02)
    assert np.diff(columns).max() > 100


@pytest.mark.slow
def test_a_chart_without_values_or_with_many_rows_is_drawn():
    for rows in (["a"], [f"weight={number}" for number in range(3000)]):
        assert bar_chart([Bars("x", rows, {"": [np.nan] * len(rows)}, [0])], value="mm").startswith(b"\x89PNG")
