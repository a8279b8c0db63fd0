"""When a background is learnt a second time."""

import pytest

from sogjax.run.relearn_background import frames_to_learn_from

SAMPLES = [*range(0, 300, 30)]


@pytest.mark.parametrize(
    ("unknown", "numbers", "expected"),
    [(0.5, range(0, 300), SAMPLES), (0.5, range(110, 190), []), (0.001, range(0, 300), [])],
    ids=["whole clip", "part with too few samples", "hardly anything unknown"],
)
def test_a_clip_is_tracked_for_its_background_only_where_that_can_help(unknown, numbers, expected):
    assert frames_to_learn_from(unknown, SAMPLES, numbers) == expected


def test_every_second_frame_has_the_samples_that_it_has():
    assert frames_to_learn_from(0.5, SAMPLES, range(0, 300, 2)) == SAMPLES


def test_samples_that_are_not_tracked_are_told(capsys):
    samples = [*range(0, 600, 30)]
    assert frames_to_learn_from(0.5, samples, range(0, 600, 20)) == samples[::2]
    assert "of 20 frames to learn the background from, 10 are tracked" in capsys.readouterr().err
