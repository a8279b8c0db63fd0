"""Rerun and Lab Streaming Layer: what they are told arrives."""

import subprocess
import sys
import time

import numpy as np
import pytest
from body_cases import shipped
from rig_cases import recording_of, ring_rig

from sogjax.errors import InputError
from sogjax.realtime.figures import Stamps
from sogjax.realtime.lab_stream import LabStream
from sogjax.realtime.rerun_live import RerunLive
from sogjax.realtime.state import ActorState, LiveState

DOG = shipped("dog")


def state(frame, tracked=True):
    joints = np.tile(np.eye(4, dtype=np.float32), (DOG.skeleton.num_joints, 1, 1))
    joints[:, :3, 3] = frame + 0.01 * np.arange(DOG.skeleton.num_joints)[:, None]
    now = time.monotonic()
    actor = ActorState("dog", tracked, np.zeros(DOG.skeleton.num_dofs, np.float32), joints, 0.9, np.zeros(0))
    return LiveState(frame, Stamps(now, now, now + 0.01, now + 0.01, now + 0.03, now), (True, True), (actor,))


def test_rerun_shows_skeletons_and_latencies(tmp_path):
    shown = RerunLive(str(tmp_path / "live.rrd"), recording_of(ring_rig(2), 8), (DOG,))
    for frame in range(3):
        shown.send(state(frame, tracked=frame != 1))
    shown.close()
    command = [sys.executable, "-m", "rerun", "rrd", "print", "-vv", str(tmp_path / "live.rrd")]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    for part in ("/world/actors/dog/skeleton", "/curves/latency/solving", "/world/cameras/cam0"):
        assert part in printed


def test_lab_streaming_layer_gets_every_joint_at_the_time_of_its_pictures():
    pylsl = pytest.importorskip("pylsl", reason="pylsl is not installed (extra `lsl`)")
    stream = LabStream("sogjax-test", (DOG,), 25.0)
    found = pylsl.resolve_byprop("name", "sogjax-test", timeout=3.0)
    if not found:
        stream.close()
        pytest.skip("streams are not found on this machine")
    inlet = pylsl.StreamInlet(found[0])
    inlet.open_stream(timeout=3.0)
    began = pylsl.local_clock()
    stream.send(state(2))
    stream.send(state(3, tracked=False))
    sample, stamp = inlet.pull_sample(timeout=3.0)
    nobody, _ = inlet.pull_sample(timeout=3.0)
    inlet.close_stream()
    stream.close()
    assert len(sample) == 3 * DOG.skeleton.num_joints
    np.testing.assert_allclose(sample[3:6], [2.01, 2.01, 2.01], atol=1e-6)
    assert stamp == pytest.approx(began, abs=0.5)
    assert np.isnan(nobody).all()


def test_without_the_extra_that_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "pylsl", None)
    with pytest.raises(InputError, match=r"sogjax\[lsl\]"):
        LabStream("motion", (DOG,), 25.0)
