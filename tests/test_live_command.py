"""`sogjax live` and `sogjax.live` on a rendered recording: what they print, leave and give."""

import json
import threading
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest
from command_line import actor_file, done, refused
from rendered_person import rendered_person
from small_recording import frame_image, make_recording

import sogjax
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.realtime.pictures import FrameSet, Seen
from sogjax.realtime.recorder import VideoRecorder
from sogjax.realtime.slot import Slot

SMALL = ("solver.max_iterations=5", "images.depth=6", "images.background=none")


CELLS = np.zeros((2, 2, 3), np.uint8)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rendered") / "person"
    return rendered_person(folder, cameras=3, frames=6, width=160, height=120)


@pytest.mark.slow
def test_the_command_leaves_motion_figures_and_a_recording(capsys, tmp_path, monkeypatch, rendered):
    monkeypatch.chdir(tmp_path)
    actor = actor_file(tmp_path / "actor.yaml")
    live = ("live", f"recording={rendered}", f"actor={actor}", "replay=true", "speed=0.2", *SMALL)
    out, err = done(capsys, *live, "json=-", "record=kept", "faults.gone={cam01:[0.3,0.7]}")
    frames = [json.loads(line)["frame"] for line in out.splitlines()]
    assert "latency after arrival" in err
    assert "motion is kept" not in err

    figures = json.loads((tmp_path / "outputs" / "person_live" / "live.json").read_text())
    assert figures["sets"] == 6
    assert figures["lost"]["late_or_missing_pictures"]["cam01"] > 0
    assert set(figures["latency_ms"]) == {"p50", "p95", "p99", "max"}
    motion = load_motion(tmp_path / "outputs" / "person_live" / "motion.npz")
    assert motion.num_frames == figures["poses"] == len(frames)
    assert set(motion.frame.tolist()) <= set(range(6))

    kept, given = open_recording(tmp_path / "kept"), open_recording(rendered)
    assert kept.num_frames == 6
    assert kept.rig.names == given.rig.names
    assert kept.missing.get("cam01")
    np.testing.assert_array_equal(kept.rig.cameras.intrinsics, given.rig.cameras.intrinsics)
    assert "overwrite" in refused(capsys, *live)
    assert "record=kept" in refused(capsys, *live, "record=kept", "overwrite=true")


def test_what_is_recorded_has_the_rate_at_which_pictures_came_and_their_own_colours(tmp_path, capsys):
    given = replace(open_recording(make_recording(tmp_path / "walk")), color_gains={"left": (1.5, 1.0, 0.5)})
    with VideoRecorder(tmp_path / "kept", given, 30.0) as recorder:
        for k in range(5):
            pictures = {c: Seen(c, CELLS, 0.04 * k, 0.0, picture=frame_image(c, k)) for c in range(2)}
            recorder.put(FrameSet(0.04 * k, 0.0, pictures))
    kept = open_recording(tmp_path / "kept")
    assert kept.fps == pytest.approx(25.0)
    assert "25.00 pictures a second, not 30" in capsys.readouterr().err
    assert kept.color_gains == given.color_gains
    np.testing.assert_allclose(kept.rig.cameras.camera_from_world, given.rig.cameras.camera_from_world, atol=1e-6)


@pytest.mark.slow
def test_ctrl_c_keeps_the_motion(capsys, tmp_path, monkeypatch, rendered):
    monkeypatch.chdir(tmp_path)
    actor, take, sets = actor_file(tmp_path / "actor.yaml"), Slot.take, []

    def interrupted(slot, timeout):
        if len(sets) >= 3:
            raise KeyboardInterrupt
        if (found := take(slot, timeout)) is not None:
            sets.append(found)
        return found

    monkeypatch.setattr(Slot, "take", interrupted)
    live = ("live", f"recording={rendered}", f"actor={actor}", "replay=true", "speed=0.2", "loop=true", *SMALL)
    _, err = done(capsys, *live, "out=run")
    assert "stopped by Ctrl-C" in err
    assert load_motion(tmp_path / "run" / "motion.npz").num_frames == 3
    assert json.loads((tmp_path / "run" / "live.json").read_text())["poses"] == 3
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == ["live.json", "motion.npz"]


@pytest.mark.slow
def test_python_iterates_over_states(rendered, tmp_path):
    actor = sogjax.load_actor(actor_file(tmp_path / "actor.yaml"))
    recording = sogjax.open_recording(rendered)
    states = sogjax.live(
        recording,
        actor,
        replay=True,
        speed=0.2,
        solver={"max_iterations": 5},
        images={"depth": 6, "background": "none"},
    )
    found = list(states)
    assert found
    assert all(isinstance(state, sogjax.LiveState) for state in found)
    assert [state.frame for state in found] == sorted({state.frame for state in found})
    person = found[-1].actors[0]
    assert person.world_from_joint.shape == (actor.skeleton.num_joints, 4, 4)
    with closing(sogjax.live(recording, actor, replay=True, speed=0.2, loop=True, images={"depth": 6})) as looped:
        assert next(looped).frame == 0
    assert not [thread for thread in threading.enumerate() if thread.name.startswith("camera")]
    with pytest.raises(sogjax.InputError, match="out"):
        sogjax.live(recording, actor, replay=True, out="x")
    with pytest.raises(sogjax.InputError, match="did you mean"):
        sogjax.live(recording, actor, replays=True)
