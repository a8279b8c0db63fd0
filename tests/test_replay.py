"""A replayed recording: its pictures come at their times, late, or not at all, as the seed says."""

import time
from dataclasses import replace
from threading import Thread

import numpy as np
import pytest
from small_recording import frame_of, make_recording

from sogjax.io.recording import open_recording
from sogjax.realtime.replay import Faults, Pace, replay_cameras
from sogjax.settings.live import FaultsConfig

FRAMES, PERIOD = 8, 0.04


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return open_recording(make_recording(tmp_path_factory.mktemp("small") / "walk", frames=FRAMES))


def taken(recording, faults=None, loop=False, most=100, **changes):
    """What every camera gives, in threads as in a session; and when the replay began."""
    cameras, pace = replay_cameras(recording, faults or FaultsConfig(**changes), 0, 1.0, loop)
    found = {camera.name: [] for camera in cameras}

    def read(camera):
        while (picture := camera.read()) is not None and len(found[camera.name]) < most:
            found[camera.name].append(picture)
        camera.close() if loop else None

    threads = [Thread(target=read, args=(camera,)) for camera in cameras]
    for thread in threads:
        thread.start()
    pace.begin()
    begin = time.monotonic()
    for thread in threads:
        thread.join(10.0)
        assert not thread.is_alive()
    return found, begin


def bgr(picture):
    return picture if isinstance(picture, np.ndarray) else picture.bgr()


def test_frames_come_at_their_times_and_are_the_recordings(recording):
    found, begin = taken(recording)
    for of_camera in found.values():
        assert [each.number for each in of_camera] == list(range(FRAMES))
        assert [frame_of(bgr(each.picture)) for each in of_camera] == list(range(FRAMES))
        steps = np.diff([each.exposed for each in of_camera])
        assert (steps > PERIOD - 1e-6).all()
        assert all(each.arrived >= each.exposed for each in of_camera)
        assert of_camera[-1].arrived - begin >= (FRAMES - 1) * PERIOD
    both = zip(*found.values(), strict=True)
    assert all(left.exposed == right.exposed for left, right in both)


def test_pictures_come_as_filmed_for_whoever_evens_them_out(recording):
    gains = dict.fromkeys(recording.rig.names, (2.0, 1.0, 0.5))
    plain, found = (taken(each)[0]["left"] for each in (recording, replace(recording, color_gains=gains)))
    for one, other in zip(plain, found, strict=True):
        np.testing.assert_array_equal(bgr(one.picture), bgr(other.picture))


def test_a_late_camera_is_late_and_the_others_are_not(recording):
    found, _ = taken(recording, delay={"right": 0.1})
    late = [each.arrived - each.exposed for each in found["right"]]
    assert min(late) >= 0.1
    assert np.median(late) < 0.15
    assert np.median([each.arrived - each.exposed for each in found["left"]]) < 0.05


def test_what_is_lost_is_drawn_by_the_seed(recording):
    numbers = lambda seed: [each.number for each in taken(recording, drop=0.5, seed=seed)[0]["left"]]
    first = numbers(1)
    assert 0 < len(first) < FRAMES
    assert numbers(1) == first
    assert numbers(2) != first or numbers(3) != first


def test_a_camera_that_is_gone_for_a_while(recording):
    found, _ = taken(recording, gone={"left": [0.1, 0.2]})
    assert [each.number for each in found["right"]] == list(range(FRAMES))
    missing = sorted(set(range(FRAMES)) - {each.number for each in found["left"]})
    assert missing
    assert missing == list(range(missing[0], missing[-1] + 1))
    assert missing[0] >= 2


def test_it_begins_again(recording):
    found, _ = taken(recording, loop=True, most=2 * FRAMES + 3)
    numbers = [each.number for each in found["left"]]
    assert numbers[: 2 * FRAMES] == [*range(FRAMES), *range(FRAMES)]


def test_the_clock_stands_still_where_a_camera_cannot_keep_up():
    pace, due = Pace(2, 0.02), {}
    pace.begin()

    def decode(camera, seconds):
        for place in range(10):
            time.sleep(seconds)
            due[camera, place] = pace.due(place)

    threads = [Thread(target=decode, args=each) for each in ((0, 0.0), (1, 0.05))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(5.0)
    assert pace.slipped > 0.2
    assert all(due[0, place] == due[1, place] for place in range(10))
    steps = np.diff([due[0, place] for place in range(10)])
    assert steps.mean() > 0.04


def test_a_closed_replay_lets_nobody_wait():
    pace = Pace(2, 0.02)
    thread = Thread(target=lambda: pace.due(0))
    thread.start()
    pace.close()
    thread.join(2.0)
    assert not thread.is_alive()


def test_faults_of_one_camera():
    config = FaultsConfig(drop=0.1, delay={"b": 0.08}, gone={"a": [1, 3]}, seed=5)
    assert Faults.of_camera(config, ("a", "b"), 0) == Faults(0.1, 0.0, 0.0, (1.0, 3.0), (5, 0))
    assert Faults.of_camera(config, ("a", "b"), 1).delay == 0.08
