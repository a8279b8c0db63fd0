"""A live session on a dog that walks: the poses of offline tracking, whatever cameras miss, and no growing delay."""

import json
import socket
import time
from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from drawn_scene import standing
from rig_cases import recording_of, ring_rig
from walking_dog import DEPTH, FRAMES, HEIGHT, STEP

from sogjax.io.frame_motions import ClipFacts
from sogjax.io.motion import load_motion
from sogjax.realtime.following import Following
from sogjax.realtime.json_lines import JsonLines
from sogjax.realtime.pictures import Taken
from sogjax.realtime.recorder import MotionRecorder
from sogjax.realtime.session import Publishers, Session
from sogjax.realtime.stepping import LiveStep
from sogjax.run.clip import Clip
from sogjax.run.setup import Setup

PERIOD = 0.05
ALL = np.ones(5, bool)


@pytest.fixture(scope="module")
def dog(walking_dog):
    """The setup of the walking dog, its cells, its offline poses, and the pose to begin with."""
    tracker, cells, offline = walking_dog
    clip = Clip(recording_of(ring_rig(5, (160, 120), distance=1.6), FRAMES), range(FRAMES), DEPTH)
    pose = np.array(standing(tracker.body, HEIGHT))
    return Setup(clip, (tracker.body,), tracker), [np.asarray(each) for each in cells], offline, pose


@pytest.fixture(scope="module")
def step(dog):
    """The compiled step: every test takes the same."""
    return LiveStep(dog[0].tracker)


def followed(dog, step, frames, present=lambda k: ALL, period=PERIOD):
    """The poses that are found in some of the frames, taken at their true times."""
    setup, cells, _, pose = dog
    following = Following(step, setup.bodies, start=pose)
    found = [following.follow(cells[k], present(k), k * period) for k in frames]
    return np.stack([np.asarray(each.tracked.result.pose) for each in found])


@pytest.mark.slow
def test_the_poses_are_those_of_offline_tracking(dog, step):
    poses = followed(dog, step, range(FRAMES))
    np.testing.assert_allclose(poses, dog[2].poses, atol=2e-3)


def test_a_camera_that_is_gone_weighs_nothing(dog, step):
    gone = np.array([True, False, True, True, True])
    setup, cells, _, pose = dog
    noise = [np.array(each) for each in cells]
    for each in noise:
        each[1] = 255 - each[1]
    missing = followed(dog, step, range(6), lambda k: gone)
    other = followed((setup, noise, None, pose), step, range(6), lambda k: gone)
    np.testing.assert_array_equal(missing, other)
    root = np.linalg.norm(missing[:, :3] - dog[2].poses[:6, :3], axis=-1)
    assert root.max() < 0.02


def test_the_motion_goes_on_for_as_long_as_time_has_passed(dog, step):
    """Of frames that come at half the rate the next pose is predicted twice as far ahead."""
    tracker = dog[0].tracker
    moment = step.start(dog[3])
    for k in (0, 1):
        moment = step(moment, dog[1][k], ALL, k * PERIOD)[0]
    last = moment.state.previous - moment.state.before_previous
    assert moment.step == pytest.approx(PERIOD)

    def predicted(ratio):
        before = moment.state.previous - ratio * last
        return tracker.predicted(replace(moment.state, before_previous=before)) - moment.state.previous

    np.testing.assert_allclose(predicted(jnp.float32(2.0)), 2.0 * predicted(jnp.float32(1.0)), atol=1e-6)
    far = step(moment, dog[1][4], ALL, 4 * PERIOD)[1].result
    expected = dog[3][0] + 4 * STEP
    assert float(far.pose[0]) == pytest.approx(expected, abs=0.01)


class GivenCamera:
    """A camera whose pictures are cells, given at their times."""

    def __init__(self, name, pictures, begin, late=0.0, lost=()):
        self.name, self._begin, self._late = name, begin, late
        self._left = [(k, picture) for k, picture in enumerate(pictures) if k not in lost]

    def read(self):
        if not self._left:
            return None
        k, picture = self._left.pop(0)
        exposed = self._begin + k * PERIOD
        time.sleep(max(exposed + self._late - time.monotonic(), 0.0))
        return Taken(picture, exposed, time.monotonic(), k)

    def close(self):
        self._left = []


def pictures_of(setup, cells, camera):
    """Pictures whose cells are these: every cell is a block of one colour (BGR)."""
    grid = setup.clip.grids[camera]
    size = grid.cell_size
    whole = [np.kron(each[camera][..., ::-1], np.ones((size, size, 1), np.uint8)) for each in cells]
    return [np.ascontiguousarray(picture[: grid.height, : grid.width]) for picture in whole]


def session_of(dog, step, period=PERIOD, **cameras):
    setup, cells, _, pose = dog
    step(step.start(pose), cells[0], ALL, 0.0)  # compiled before the first picture
    begin = time.monotonic() + 0.3
    given = [
        GivenCamera(name, pictures_of(setup, cells, k), begin, **cameras.get(name, {}))
        for k, name in enumerate(setup.clip.recording.rig.names)
    ]
    return Session(setup, given, Following(step, setup.bodies, start=pose), period)


def test_from_pictures_to_states_motion_lines_and_figures(dog, step, tmp_path):
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.bind(("127.0.0.1", 0))
    receiver.settimeout(2.0)
    session = session_of(dog, step, cam1={"lost": (3, 4)}, cam4={"late": 0.04})
    names = session.names
    lines = JsonLines(f"127.0.0.1:{receiver.getsockname()[1]}", session.setup.bodies, names)
    session.publishers = Publishers({"json": lines}, {})
    facts = ClipFacts(1.0 / PERIOD, "z", names)
    session.motion = MotionRecorder(tmp_path, session.setup.bodies, facts)
    states = list(session.states())
    report = session.report()

    assert report["sets"] == FRAMES
    assert len(states) + report["lost"]["overwritten_sets"] == FRAMES
    assert report["lost"]["late_or_missing_pictures"]["cam1"] >= 2
    assert report["lost"]["of_these_late"]["cam4"] > 0
    assert report["slowest_camera"] == "cam4"
    for state in states:
        stamps = state.stamps
        assert stamps.arrived <= stamps.handed_over <= stamps.begun <= stamps.solved
        pose = np.asarray(state.actors[0].pose)
        assert np.linalg.norm(pose[:3] - dog[2].poses[state.frame, :3]) < 0.03  # some are left out on a busy machine

    (path,) = session.motion.finish()
    motion = load_motion(path)
    np.testing.assert_array_equal(motion.frame, [state.frame for state in states])
    np.testing.assert_allclose(motion.world_from_joint[-1], states[-1].actors[0].world_from_joint, atol=1e-5)
    assert sorted(file.name for file in tmp_path.iterdir()) == ["motion.npz"]

    messages = [
        json.loads(receiver.recv(65536)) for _ in range(len(states) - report["lost"]["not_passed_on"]["publisher"])
    ]
    receiver.close()
    last = messages[-1]
    assert last["version"] == 1
    assert last["frame"] == states[-1].frame
    assert last["cameras"] == [name for name, there in zip(names, states[-1].present, strict=True) if there]
    told = last["actors"][0]
    np.testing.assert_allclose([*told["joints"].values()], states[-1].actors[0].world_from_joint[:, :3, 3], atol=1e-5)
    assert [*last["times"]] == ["exposed", "arrived", "handed_over", "solved", "sent"]
    assert sorted(last["times"].values()) == [*last["times"].values()]


def test_who_takes_long_misses_states_and_the_delay_does_not_grow(dog, step):
    session, delays = session_of(dog, step), []
    for state in session.states():
        delays.append(time.monotonic() - state.stamps.arrived)
        time.sleep(2.5 * PERIOD)
    assert session.slot.overwritten > 0
    assert delays[-1] < 3.0 * PERIOD + max(delays[0], 0.1)


def test_cameras_that_are_faster_than_said_are_told_once(dog, step, capsys):
    session = session_of(dog, step, period=1.5 * PERIOD)
    session.slot.handed_over = 30
    session._say_rate(30 * 1.5 * PERIOD)
    assert not capsys.readouterr().err
    session._say_rate(30 * PERIOD)
    session._say_rate(30 * PERIOD)
    assert capsys.readouterr().err.count("pictures a second, not 13.33: the motion would be too slow; give fps=") == 1


def test_a_publisher_is_told_all_before_it_is_closed(dog, step):
    told = []

    class Slow:
        def send(self, state):
            time.sleep(1.5 * PERIOD)
            told.append(state.frame)

        def close(self):
            told.append("closed")

    session = session_of(dog, step)
    session.publishers = Publishers({"slow": Slow()}, {})
    frames = [state.frame for state in session.states()]
    assert told[-2:] == [frames[-1], "closed"]


def test_closing_the_iterator_closes_the_cameras(dog, step):
    session = session_of(dog, step)
    states = session.states()
    next(states)
    states.close()
    assert all(camera.read() is None for camera in session.cameras)
