"""When a background is learnt a second time."""

from dataclasses import replace

import numpy as np
import pytest

from sogjax.run import relearn_background
from sogjax.run.background import Background
from sogjax.run.relearn_background import frames_to_learn_from, without_body
from sogjax.run.setup import Setup
from sogjax.scene.background import BackgroundImage

SAMPLES = [*range(0, 300, 30)]


@pytest.mark.parametrize(
    ("unknown", "taken", "expected"),
    [
        (0.5, [], "50.0% of the background is unknown"),
        (0.001, ["b", "d"], "b and d took the body for background"),
        (0.001, [], None),
    ],
)
def test_a_background_is_learnt_again_only_where_that_can_help(monkeypatch, unknown, taken, expected):
    learnt = Background((replace(BackgroundImage.nothing(6, 4), origin="clip"),))
    monkeypatch.setattr(relearn_background, "unknown_share", lambda setup: unknown)
    monkeypatch.setattr(relearn_background, "cameras_that_took_bodies", lambda *_: taken)
    unseen = Setup.__new__(Setup)
    assert relearn_background.why_learn_again(unseen, learnt, {}) == expected
    photographed = Background((replace(BackgroundImage.nothing(6, 4), origin="picture"),))
    assert relearn_background.why_learn_again(unseen, photographed, {}) is None


@pytest.mark.parametrize(("numbers", "expected"), [(range(0, 300), SAMPLES), (range(110, 190), [])])
def test_too_few_samples_that_are_tracked_tell_nothing(numbers, expected):
    assert frames_to_learn_from(SAMPLES, numbers) == expected


def test_every_second_frame_has_the_samples_that_it_has():
    assert frames_to_learn_from(SAMPLES, range(0, 300, 2)) == SAMPLES


def test_samples_that_are_not_tracked_are_told(capsys):
    samples = [*range(0, 600, 30)]
    assert frames_to_learn_from(samples, range(0, 600, 20)) == samples[::2]
    assert "of 20 frames to learn the background from, 10 are tracked" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("stays", "alike", "fewest", "known"),
    [(9, True, 8, False), (9, False, 8, True), (4, True, 8, True), (1, True, 1, False), (1, False, 1, True)],
)
def test_what_a_background_took_from_a_body_that_stays_is_unknown(stays, alike, fewest, known):
    """Covered by the body in so many of twelve samples, which show what was taken for background, or something else."""
    picture = np.full((4, 6, 3), 90, np.uint8)
    first = BackgroundImage(picture, np.full((4, 6), 2.0, np.float32), np.ones((4, 6), bool), "clip")
    shown = {frame: picture + np.uint8(0 if alike else 60) for frame in range(12)}
    body = np.zeros((4, 6), bool)
    body[1:3, 2:4] = True
    found = without_body(first, shown, {frame: body & (frame < stays) for frame in range(12)}, fewest)
    assert (found.known[body] == known).all()
    assert found.known[~body].all()
    assert without_body(replace(first, origin="picture"), shown, dict.fromkeys(range(12), body), 1).known.all()


def test_poses_that_are_known_are_those_of_the_samples_nearest_to_them():
    one, other = np.zeros(3, np.float32), np.ones(3, np.float32)
    found = relearn_background._at_samples({44: one, 299: other}, SAMPLES)
    assert [*found] == [30, 270]
    assert found[30] is one
    assert found[270] is other
