"""A run that was stopped goes on to the very end that it would have had, or is refused."""

import errno
import os
import random
import signal
import subprocess
import sys
import time
from dataclasses import fields

import jax.numpy as jnp
import numpy as np
import pytest
from command_line import actor_file, done, refused, trackable
from slow_values import fast_and_slow
from small_recording import write_video

from sogjax.cli.main import main
from sogjax.io import array_log, video
from sogjax.io.actor_file import load_body
from sogjax.io.frame_motions import load_one_motion
from sogjax.io.motion import Motion, load_motion
from sogjax.run import forward, initial_pose, passes
from sogjax.run.actors import Actors
from sogjax.tracking import frame_by_frame
from sogjax.tracking.culling import Capacities

FRAMES, KILLS = 20, 3
LIGHT = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false", "outputs.bvh=false")
SMALL = ("images.depth=4", "solver.max_iterations=3", "solver.min_iterations=1")


@pytest.fixture
def recording(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return trackable(tmp_path / "walk", frames=FRAMES)


@pytest.fixture
def command(recording, tmp_path):
    return ["track", f"recording={recording}", f"actor={actor_file(tmp_path / 'a.yaml')}", *SMALL, *LIGHT]


def stop_after(monkeypatch, frames):
    """As Ctrl-C while a frame is tracked."""
    whole, seen = forward.frames_done, []

    def frames_done(*arguments, **named):
        for found in whole(*arguments, **named):
            if len(seen) == frames:
                raise KeyboardInterrupt
            seen.append(found)
            yield found

    monkeypatch.setattr(forward, "frames_done", frames_done)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def assert_same(folder, other, name="motion.npz"):
    one, two = load_motion(folder / name), load_motion(other / name)
    for entry in fields(Motion):
        np.testing.assert_array_equal(getattr(one, entry.name), getattr(two, entry.name), entry.name)


@pytest.mark.parametrize("stops", fast_and_slow((9,), (1,), (17, 3), (20,)))
def test_the_end_is_that_of_a_run_that_was_not_stopped(capsys, tmp_path, monkeypatch, command, stops):
    done(capsys, *command, "out=whole")
    for frames in stops:
        with monkeypatch.context() as context:
            stop_after(context, frames)
            main([*command, "out=run", "resume=true"])
    done(capsys, *command, "out=run", "resume=true")
    assert_same(tmp_path / "run", tmp_path / "whole")
    assert names(tmp_path / "run") == names(tmp_path / "whole")
    assert not [name for name in names(tmp_path / "run") if name.endswith(".partial")]
    _, err = done(capsys, *command, "out=run", "resume=true")
    assert "already ended" in err


def person_file(folder, name, red):
    def change(content):
        content["name"] = name
        content["blobs"][1]["color"][0] = red

    return actor_file(folder / f"{name}.yaml", change)


@pytest.mark.slow
def test_two_actors(capsys, tmp_path, monkeypatch, recording):
    (recording / "initial_pose.yaml").write_text(
        "one: {pose: rest, position: [0, 0, 1], heading: 0}\ntwo: {pose: rest, position: [0.5, 0, 1], heading: 0}\n"
    )
    files = [person_file(tmp_path, name, red) for name, red in (("one", 0.6), ("two", 0.5))]
    words = ["track", f"recording={recording}", f"actor=[{files[0]},{files[1]}]", *SMALL, *LIGHT]
    done(capsys, *words, "out=whole")
    with monkeypatch.context() as context:
        stop_after(context, 12)
        assert main([*words, "out=run"]) == 130
    done(capsys, *words, "out=run", "resume=true")
    for name in ("motion_one.npz", "motion_two.npz"):
        assert_same(tmp_path / "run", tmp_path / "whole", name)


@pytest.mark.slow
def test_the_tracker_goes_on_with_the_capacities_that_it_stopped_with(capsys, tmp_path, monkeypatch, command):
    """Room for image blobs that had to grow is not counted anew: sums of other lengths are rounded otherwise."""
    grown = Capacities(near=512, matching=512, blocks=2048)
    monkeypatch.setattr(frame_by_frame, "first_capacities", lambda *_: grown)
    done(capsys, *command, "out=whole")
    with monkeypatch.context() as context:
        stop_after(context, 10)
        main([*command, "out=run"])
    monkeypatch.setattr(frame_by_frame, "first_capacities", lambda *_: pytest.fail("counted anew"))
    done(capsys, *command, "out=run", "resume=true")
    assert_same(tmp_path / "run", tmp_path / "whole")


@pytest.mark.slow
def test_a_searched_pose_and_a_made_actor_are_kept(capsys, tmp_path, monkeypatch, recording):
    """Exactly, not as rounded in an actor's file; neither is looked for again."""
    body = load_body(actor_file(tmp_path / "a.yaml")).rotated(jnp.asarray(turn(0.3)))
    monkeypatch.setattr(passes, "kept_or_made", lambda *_: Actors((body,)))
    words = ["track", f"recording={recording}", *SMALL, *LIGHT]
    done(capsys, *words, "out=whole")
    with monkeypatch.context() as context:
        stop_after(context, 10)
        main([*words, "out=run"])
    never = lambda *_: pytest.fail("looked for again")
    monkeypatch.setattr(passes, "kept_or_made", never)
    monkeypatch.setattr(initial_pose, "from_file", never)
    monkeypatch.setattr(passes, "find_initial_pose", never)
    done(capsys, *words, "out=run", "resume=true")
    assert_same(tmp_path / "run", tmp_path / "whole")
    assert (tmp_path / "run" / "actor.yaml").read_bytes() == (tmp_path / "whole" / "actor.yaml").read_bytes()


def turn(angle):
    """About the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    return [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]


def other_setting(recording, tmp_path):
    return ["energy.limit_weight=3"], "energy.limit_weight was 1.0, now it is 3.0"


def other_actor(recording, tmp_path):
    actor_file(tmp_path / "a.yaml", lambda content: content["blobs"][0].update(sigma=0.11))
    return [], "the actors changed"


def other_pictures(recording, tmp_path):
    write_video(recording / "videos" / "right.mp4", 0, frames=FRAMES)
    return [], "the pictures of right changed"


def other_first_pose(recording, tmp_path):
    (recording / "initial_pose.yaml").write_text("pose: rest\nposition: [0.1, 0, 1]\nheading: 0\n")
    return [], "the rough pose changed"


def other_version(recording, tmp_path):
    note = tmp_path / "run" / "run.partial" / "run.json"
    note.write_text(note.read_text().replace('"jax": "', '"jax": "9'))
    return [], "jax was 9"


@pytest.mark.parametrize(
    "change", fast_and_slow(other_setting, other_actor, other_pictures, other_first_pose, other_version)
)
def test_a_run_that_was_begun_with_something_else_is_not_gone_on_with(
    capsys, tmp_path, monkeypatch, command, recording, change
):
    with monkeypatch.context() as context:
        stop_after(context, 10)
        main([*command, "out=run"])
    words, expected = change(recording, tmp_path)
    capsys.readouterr()
    assert expected in refused(capsys, *command, *words, "out=run", "resume=true")
    assert load_one_motion(tmp_path / "run" / "run.partial").num_frames >= 8
    done(capsys, *command, *words, "out=run", "overwrite=true")
    assert not (tmp_path / "run" / "run.partial").exists()


def full_disk(monkeypatch, module, name, after):
    """Writing fails with half of the bytes written, at a chosen call."""
    whole, calls = getattr(module, name), []

    def write(self, content):
        calls.append(1)
        if len(calls) < after:
            return whole(self, content)
        whole(self, content[: len(content) // 2])
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(module, name, write)


@pytest.mark.parametrize("after", fast_and_slow(5, 2, 3, 6, 7))
def test_a_full_disk_leaves_what_can_be_read_and_gone_on_with(capsys, tmp_path, monkeypatch, command, after):
    done(capsys, *command, "out=whole")
    with monkeypatch.context() as context:
        full_disk(context, array_log.ArrayLog, "_write", after)
        assert main([*command, "out=run"]) == 2
    assert "No space left on device" in capsys.readouterr().err
    partial = tmp_path / "run" / "run.partial"
    if (partial / "frames").exists():
        so_far, complete = load_one_motion(partial), load_motion(tmp_path / "whole" / "motion.npz")
        np.testing.assert_array_equal(so_far.pose, complete.pose[: so_far.num_frames])
    done(capsys, *command, "out=run", "resume=true")
    assert_same(tmp_path / "run", tmp_path / "whole")


class BreaksOff:
    """A video on a disk that goes away after a few images."""

    def __init__(self, stream):
        self.stream, self.count = stream, 0
        self.skip, self.close = stream.skip, stream.close

    def read(self):
        self.count += 1
        return None if self.count > FRAMES - 6 else self.stream.read()


def test_a_video_that_breaks_off_and_is_there_again(capsys, tmp_path, monkeypatch, command):
    """The file itself has not changed."""
    words = [*command, "images.background=none"]
    done(capsys, *words, "out=whole")
    whole = video.open_with_least_work
    with monkeypatch.context() as context:
        context.setattr(video, "open_with_least_work", lambda *given, **more: BreaksOff(whole(*given, **more)))
        assert main([*words, "out=run"]) == 2
    assert "ends before frame 15" in capsys.readouterr().err  # frame 0 was read before, for the initial pose
    done(capsys, *words, "out=run", "resume=true")
    assert_same(tmp_path / "run", tmp_path / "whole")


@pytest.mark.slow
def test_killed_at_random_moments(tmp_path, command):
    """SIGKILL; `tests/reliability/kill_and_resume.py` does the same with all outputs, 20 times."""
    environment = os.environ | {"SOGJAX_COMPILATION_CACHE": str(tmp_path / "programs")}
    started = lambda *words: subprocess.Popen(
        [sys.executable, "-m", "sogjax", *command, *words],
        env=environment,
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    _, err = started("out=whole").communicate()
    begin = time.perf_counter()
    _, err = started("out=whole", "overwrite=true").communicate()
    life = time.perf_counter() - begin
    assert (tmp_path / "whole" / "motion.npz").is_file(), err
    chance = random.Random(3)
    for _ in range(KILLS):
        process = started("out=run", "resume=true")
        while process.poll() is None and not (tmp_path / "run" / ".lock").exists():
            time.sleep(0.02)
        try:
            process.communicate(timeout=chance.uniform(0.0, 0.7 * life))
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.communicate()
    process = started("out=run", "resume=true")
    _, err = process.communicate()
    assert process.returncode == 0, err
    assert_same(tmp_path / "run", tmp_path / "whole")
    assert names(tmp_path / "run") == names(tmp_path / "whole")
    assert not [name for name in names(tmp_path / "run") if name.endswith(".partial")]
