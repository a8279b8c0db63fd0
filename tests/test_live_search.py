"""Searching beside: who comes in is found, the tracker catches up with the present, and memory stays bounded."""

import time
from dataclasses import dataclass, field
from threading import Event
from types import SimpleNamespace

import numpy as np
import pytest
from drawn_scene import standing
from walking_dog import FRAMES, HEIGHT

from sogjax.realtime import searching
from sogjax.realtime.following import Following
from sogjax.realtime.searching import Found, HeldFrame, SearchBeside
from sogjax.realtime.stepping import LiveStep
from sogjax.run.clip_search import NUM_FOLLOWED, SECONDS
from sogjax.search.found_pose import FoundPose, Path

pytestmark = pytest.mark.slow

PERIOD = 0.04
ALL = np.ones(5, bool)


@dataclass
class StandInSearch:
    """Finds the poses that it was told to find, in the first of the frames, after a while."""

    bodies: tuple
    poses: list
    seconds: float = 0.2
    given: list = field(default_factory=list)

    def paths_in(self, frames, report=None):
        self.given.append(frames)
        time.sleep(self.seconds)
        pose = self.poses.pop(0) if len(self.poses) > 1 else self.poses[0]
        if pose is None:
            return [Path.of_nothing(self.bodies[0], len(frames))]
        found = FoundPose(pose, 2.0, 0.5, True, 1.0)
        return [Path(found, np.repeat(pose[None], len(frames), axis=0))]


@pytest.fixture(scope="module")
def step(walking_dog):
    found = LiveStep(walking_dog[0])
    pose = np.array(standing(walking_dog[0].body, HEIGHT))
    found(found.start(pose), np.asarray(walking_dog[1][0]), ALL, 0.0)
    return found


def frames_until(following, cells, stop, begin=0, most=4000):
    """Feed frames, the last one again and again, at their rate; the frame at which `stop` holds.

    So many at most, since on a busy machine the search beside takes its time.
    """
    for k in range(begin, begin + most):
        solved = following.follow(cells[min(k, len(cells) - 1)], ALL, k * PERIOD)
        if stop(solved):
            return k, solved
        time.sleep(0.5 * PERIOD)
    raise AssertionError("never")


def test_who_comes_in_is_found_and_followed_up_to_the_present(walking_dog, step, capsys):
    tracker, cells, offline = walking_dog
    cells = [np.asarray(each) for each in cells]
    search = StandInSearch((tracker.body,), [None, np.array(offline.poses[0])])
    beside = SearchBeside(search, LiveStep(tracker, step.capacities, step.spare))
    following = Following(step, (tracker.body,), beside)
    following._rest = 0.1
    frame, solved = frames_until(following, cells, lambda solved: solved is not None)
    beside.close()
    assert len(search.given) == 2  # the first one was in vain
    spaced = search.given[1]
    assert len(spaced) == NUM_FOLLOWED
    assert frame * PERIOD > 2 * (NUM_FOLLOWED - 1) * SECONDS
    # The dog has walked on since: the pose is that of the last frame, not of the one that was searched.
    np.testing.assert_allclose(solved.tracked.result.pose[:3], offline.poses[-1][:3], atol=0.02)
    said = capsys.readouterr().err
    assert "nobody is in view" in said
    assert "found" in said


def test_who_leaves_is_nobody_and_is_found_again(walking_dog, step):
    tracker, cells, offline = walking_dog
    cells = [np.asarray(each) for each in cells]
    empty = [np.full_like(cells[0], 40)]
    beside = SearchBeside(
        StandInSearch((tracker.body,), [None, np.array(offline.poses[-1])]),
        LiveStep(tracker, step.capacities, step.spare),
    )
    following = Following(step, (tracker.body,), beside, start=np.array(offline.poses[0]))
    for k in range(FRAMES):
        assert following.follow(cells[k], ALL, k * PERIOD) is not None
    last, _ = frames_until(following, empty, lambda solved: solved is None, FRAMES)
    assert following.losses == 1
    back, solved = frames_until(following, cells[-1:], lambda solved: solved is not None, last + 1)
    beside.close()
    assert solved is not None
    assert back > last


@pytest.mark.parametrize("came", [0, 1, 5, 40])
def test_what_was_found_catches_up_however_many_frames_come_meanwhile(walking_dog, step, came):
    tracker, cells, offline = walking_dog
    cells, exposures = np.asarray(cells[0]), iter(PERIOD * np.arange(100_000))
    hold = lambda: beside.hold(HeldFrame(cells, ALL, next(exposures)))
    tracked = []

    def slow_step(moment, _cells, _present, exposed):
        tracked.append(exposed)
        for _ in range(came):
            hold()
        return moment, SimpleNamespace(result=SimpleNamespace(energy=1.0)), None

    slow_step.start = step.start
    beside = SearchBeside(StandInSearch((tracker.body,), [np.array(offline.poses[0])], seconds=0.0), step)
    beside.step = slow_step
    for _ in range(100):
        hold()
    beside._run(Event())
    found = beside.taken()
    assert found.exposed == tracked[-1]
    last = next(exposures) / PERIOD - 1
    assert last - found.exposed / PERIOD <= max(3, came) + 1e-6
    assert len(tracked) < 60


@pytest.mark.parametrize(("tracked", "seconds"), [(False, 4.0), (True, 30.0)])
def test_after_searches_in_vain_who_enters_does_not_wait_long(walking_dog, step, tracked, seconds):
    tracker, _, offline = walking_dog
    following = Following(step, (tracker.body,), start=np.array(offline.poses[0]) if tracked else None)
    for _ in range(6):
        following._take_over(Found(None), now=0.0)
    assert following._not_before == seconds


def test_what_is_held_while_searching_stays_within_its_bytes(walking_dog, step, monkeypatch):
    tracker, cells, _ = walking_dog
    cells = np.asarray(cells[0])
    monkeypatch.setattr(searching, "MOST_HELD", 20 * cells.nbytes)
    beside = SearchBeside(StandInSearch((tracker.body,), [None], seconds=0.5), step)
    beside.begin()
    held = []
    for k in range(200):
        beside.hold(HeldFrame(cells, ALL, k * PERIOD))
        held.append(len(beside._held))
    assert max(held) <= 20
    kept = [frame.exposed for frame in beside._held]
    assert kept[0] == 0.0
    assert kept[-1] > 150 * PERIOD  # still up to the present
    beside.close()
