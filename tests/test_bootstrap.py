"""Intervals of means: what they cover, how they shrink, and what they leave out."""

import numpy as np
import pytest

from sogjax.study.summary import Interval, bootstrap_interval


def test_interval_of_independent_frames_is_that_of_the_central_limit():
    values = np.random.default_rng(1).normal(20.0, 5.0, 400)
    low, high = bootstrap_interval([values], block=1)
    half = 1.96 * values.std() / np.sqrt(400)
    np.testing.assert_allclose([low, high], [values.mean() - half, values.mean() + half], atol=0.15)


def of_recordings(rng, count):
    """Errors of recordings that differ, with neighbouring frames alike (lag 1: 0.85)."""
    clips = []
    for _ in range(count):
        clip = [rng.normal()]
        for _ in range(39):
            clip.append(0.85 * clip[-1] + 0.53 * rng.normal())
        clips.append(np.array(clip) + rng.normal(0.0, 1.0))
    return clips


@pytest.mark.parametrize("count", [2, 3, 8, 12])
def test_interval_covers_the_true_mean_of_recordings_about_as_often_as_it_says(count):
    rng, covered = np.random.default_rng(2), []
    for _ in range(400):
        low, high = bootstrap_interval(of_recordings(rng, count), draws=200)
        covered.append(low <= 0.0 <= high)
    assert 0.925 <= np.mean(covered) <= 0.99


def test_a_clip_too_short_for_blocks_says_nothing():
    assert np.isnan(bootstrap_interval([np.array([1.0, 2.0])])).all()
    low, high = bootstrap_interval([np.arange(8.0)])
    assert low < 3.5 < high


def test_blocks_know_that_neighbouring_frames_are_alike():
    walk = np.repeat(np.random.default_rng(3).normal(0.0, 1.0, 30), 10)
    wide, narrow = (bootstrap_interval([walk], block=block) for block in (10, 1))
    assert wide.high - wide.low > 2.0 * (narrow.high - narrow.low)


def test_recordings_count_by_their_frames_and_missing_frames_do_not():
    clips = [np.full(30, 1.0), np.full(10, 1.0), np.full(5, np.nan)]
    assert bootstrap_interval(clips) == pytest.approx((1.0, 1.0))
    assert np.isnan(bootstrap_interval([np.full(3, np.nan)])).all()
    assert np.isnan(bootstrap_interval([])).all()


@pytest.mark.parametrize(("interval", "zero"), [((-1.0, 1.0), True), ((0.1, 1.0), False), ((-2.0, -0.1), False)])
def test_a_difference_shows_where_its_interval_leaves_zero_out(interval, zero):
    assert Interval(*interval).holds_zero is zero
    assert Interval(float("nan"), float("nan")).holds_zero
