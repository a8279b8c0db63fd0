"""Charts of studies: names stand beside their lines, and no marker is cut."""

import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from sogjax.view import charts
from sogjax.view.charts import Means, mean_chart, spaced


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=12))
def test_names_are_apart_in_their_order_and_below_the_top(heights):
    moved = np.array(spaced(sorted(heights), 0.06))
    assert np.all(np.diff(moved) >= 0.06 - 1e-9)
    assert moved.max() <= 1.0


def test_names_that_are_apart_already_stay():
    assert spaced([0.1, 0.4, 0.9], 0.06) == [0.1, 0.4, 0.9]


def drawn(paper=None, count=1, **more):
    """A chart's pixels, BGR."""
    panel = Means(["a", "b"], [20.0, 22.0], [(19.0, 21.0), (21.0, 23.0)], **more)
    content = mean_chart([panel] * count, axis="x", value="mm", paper=paper)
    return cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_COLOR).astype(int)


def beside(picture):
    """How many columns right of the panel's frame have ink."""
    dark = (picture < 130).all(axis=2)
    frame = np.flatnonzero(dark.mean(axis=0) > 0.5).max()
    return int(dark[:, frame + 1 :].any(axis=0).sum())


def test_lines_are_named_right_of_the_panel():
    members = {"walk": [18.0, 21.0], "squat": [22.0, float("nan")], "nothing": [float("nan")] * 2}
    assert beside(drawn()) < 5
    assert beside(drawn(members=members)) > 10


def test_the_top_marker_of_the_papers_panel_is_whole(monkeypatch):
    monkeypatch.setattr(charts, "PAPER", "#ff00ff")
    picture = drawn(paper={"a": 43.0, "b": 44.0})
    rows, columns = np.nonzero((np.abs(picture - [255, 0, 255]) < 40).all(axis=2))
    right = columns > columns.max() - 4  # within the square at the right end, which is the top one
    left = columns < columns.min() + 4
    assert np.ptp(rows[right]) == np.ptp(rows[left])


def test_each_method_has_a_panel_of_its_own(monkeypatch):
    monkeypatch.setattr(charts, "INK", "#ff00ff")
    inked = [(np.abs(drawn(count=count) - [255, 0, 255]) < 40).all(axis=2).sum() for count in (1, 2)]
    assert inked[1] > 1.8 * inked[0] > 0
