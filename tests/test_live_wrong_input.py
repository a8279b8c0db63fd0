"""What is wrong with a live session is one sentence before any work; what can go on goes on."""

import socket
import time
from threading import Thread

import cv2
import numpy as np
import pytest
from command_line import actor_file, done, refused, trackable
from rig_cases import recording_of as recording_with
from rig_cases import ring_rig
from small_recording import SIZE, toml_camera, write_calibration, write_image, write_video

from sogjax.errors import InputError
from sogjax.io.image_file import read_image
from sogjax.io.recording import open_place
from sogjax.io.recording_files import BACKGROUND
from sogjax.realtime.addresses import Address, Datagrams
from sogjax.realtime.opened_camera import OpenedCamera
from sogjax.realtime.start import checked, recording_of
from sogjax.settings.compose import composed_config
from sogjax.settings.live import LiveConfig


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A calibration of two cameras, and nothing else."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "studio"
    folder.mkdir()
    write_calibration(folder, *(toml_camera(name) for name in ("left", "right")))
    (folder / "recording.yaml").write_text("up: z\n")
    return folder


def live(capsys, place, *words):
    return refused(capsys, "live", f"recording={place}", f"actor={actor_file(place.parent / 'a.yaml')}", *words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "name the cameras"),
        (("sources={third:0}",), "there is no camera 'third'"),
        (("sources={left:0,right:0}",), "left and right are both 0"),
        (("sources={left:/dev/null,right:/dev/../dev/null}",), "left and right are both"),
        (("sources={left:nowhere.mp4}",), "camera left: nowhere.mp4 does not open"),
        (("sources={left:0}", "replay=true"), "exclude each other"),
        (("sources={left:0}", "fps=0"), "fps=0"),
        (("sources={left:0}", "speed=0"), "speed=0"),
        (("sources={left:nowhere.mp4}", "vmc=127.0.0.1:0"), "the port must be"),
        (("sources={left:nowhere.mp4}", "json=nobody.invalid:1"), "the host 'nobody.invalid' is not known"),
        (("sources={left:nowhere.mp4}", "record=studio"), "record=studio: holds a recording"),
    ],
)
def test_wrong_cameras(capsys, place, words, said):
    assert said in live(capsys, place, *words)
    assert not (place.parent / "outputs").exists()


def test_a_camera_of_another_size_than_calibrated(capsys, place):
    write_video(place.parent / "large.mp4", size=(96, 64))
    sentence = live(capsys, place, f"sources={{left:{place.parent / 'large.mp4'}}}")
    assert "96x64" in sentence
    assert "64x48" in sentence


def test_no_actor(capsys, place):
    write_video(place.parent / "left.mp4")
    sentence = refused(capsys, "live", f"recording={place}", f"sources={{left:{place.parent / 'left.mp4'}}}")
    assert "needs an actor" in sentence


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("delay={third:0.1}", "there is no camera 'third'"),
        ("delay={left:soon}", "left has soon; should be {CAMERA:SECONDS}"),
        ("delay={left:-1}", "left has -1"),
        ("delay=0.1", "should be {CAMERA:SECONDS}"),
        ("gone={left:[10]}", "should be {CAMERA:[FROM,TO]}"),
        ("drop=1", "faults.drop=1"),
    ],
)
def test_a_replay_with_faults_that_cannot_be(capsys, tmp_path, monkeypatch, fault, said):
    monkeypatch.chdir(tmp_path)
    recording = trackable(tmp_path / "walk")
    assert said in live(capsys, recording, "replay=true", "images.background=none", f"faults.{fault}")


@pytest.mark.parametrize("text", ["127.0.0.1:0", "127.0.0.1:70000", "nobody.invalid:39539", "127.0.0.1:port"])
def test_no_address(text):
    with pytest.raises(InputError, match=text):
        Address.of("vmc", text, 39539)


def test_an_address_is_this_machine_and_the_usual_port_unless_told_otherwise():
    assert Address.of("vmc", "39540", 39539) == Address("127.0.0.1", 39540)
    assert Address.of("vmc", "localhost", 39539) == Address("localhost", 39539)


def test_where_nobody_listens_datagrams_are_lost_and_nothing_else(tmp_path):
    datagrams = Datagrams(str(tmp_path / "none.sock"))
    for _ in range(3):
        datagrams.send(b"line\n")
    datagrams.close()


def test_lines_reach_a_local_socket(tmp_path):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "lines.sock"))
        datagrams = Datagrams(str(tmp_path / "lines.sock"))
        datagrams.send(b"line\n")
        assert listener.recv(100) == b"line\n"
        datagrams.close()


def test_no_viewer_answers():
    from sogjax.view.rerun.live import LiveScene, _opened_viewer

    with socket.socket() as used:
        used.bind(("127.0.0.1", 0))
        with pytest.raises(InputError, match=r"^rerun=127.0.0.1:\d+: no viewer answers"):
            LiveScene(f"127.0.0.1:{used.getsockname()[1]}", recording_with(ring_rig(2), 8), [])
    with socket.socket() as used:
        try:
            used.bind(("127.0.0.1", 9876))
        except OSError:
            pytest.skip("the port of Rerun's viewer is in use on this machine")
        used.listen()
        with pytest.raises(InputError, match="9876 is in use"):
            _opened_viewer()


def test_a_place_needs_no_videos(place):
    write_image(BACKGROUND.of(place) / "left.png", np.full((SIZE[1], SIZE[0], 3), 90, np.uint8))
    recording = open_place(place)
    assert recording.rig.names == ("left", "right")
    assert [*recording.background] == ["left"]
    config = composed_config(LiveConfig, "live", {"recording": place, "sources": {"left": 1}, "fps": 50.0}.items())
    checked(config)
    assert recording_of(config).rig.names == ("left",)
    assert recording_of(config).fps == 50.0


def test_the_background_is_learnt_in_place_of_the_old_one(place, monkeypatch, capsys):
    monkeypatch.setattr("sogjax.realtime.learn_background.SECONDS", 0.3)
    write_video(place.parent / "left.mp4", frames=12)
    write_image(BACKGROUND.of(place) / "left.jpg", np.zeros((SIZE[1], SIZE[0], 3), np.uint8))
    words = ("live", f"recording={place}", "sources={left:left.mp4}", "learn_background=true")
    assert "overwrite=true" in refused(capsys, *words)
    done(capsys, *words, "overwrite=true")
    (path,) = BACKGROUND.of(place).iterdir()
    assert path.name == "left.png"
    assert read_image(path).any()


def test_a_calibration_without_sizes_is_refused_for_cameras(place):
    write_calibration(place, toml_camera("left", size=None))
    with pytest.raises(InputError, match="size"):
        open_place(place)


def test_a_file_as_a_camera_ends(tmp_path):
    write_video(tmp_path / "left.mp4", frames=3)
    camera = OpenedCamera("left", str(tmp_path / "left.mp4"), SIZE)
    assert [camera.read() is not None for _ in range(4)] == [True, True, True, False]
    camera.release()


def test_a_file_gives_its_pictures_at_its_own_rate(tmp_path):
    write_video(tmp_path / "left.mp4", frames=6)  # 20 frames a second
    camera = OpenedCamera("left", str(tmp_path / "left.mp4"), SIZE)
    times = [taken.arrived for taken in iter(camera.read, None)]
    np.testing.assert_allclose(np.diff(times), 0.05, atol=0.03)
    camera.release()


@pytest.fixture
def device(tmp_path, monkeypatch):
    """A path at which videos are opened as devices are: as if they were no files."""
    monkeypatch.setattr("pathlib.Path.is_file", lambda path: False)
    monkeypatch.setattr("sogjax.realtime.opened_camera.TRIED_AGAIN", 0.05)
    return tmp_path / "left.mp4"


def test_a_cameras_first_picture_is_not_one_from_before_all_was_ready(device):
    write_video(device, frames=3)
    first, second = first_two(device)
    taken = OpenedCamera("left", str(device), SIZE).read()
    assert taken is not None
    assert not np.array_equal(first, second)
    np.testing.assert_array_equal(taken.picture, second)


def first_two(path):
    capture = cv2.VideoCapture(str(path))
    return [capture.read()[1] for _ in range(2)]


def test_a_camera_that_comes_back_with_another_size_is_said_once_and_not_used(device, monkeypatch):
    said, taken = [], []
    monkeypatch.setattr("sogjax.realtime.opened_camera.say", said.append)
    write_video(device, frames=1)
    camera = OpenedCamera("left", str(device), SIZE)
    write_video(device, frames=2, size=(96, 64))
    thread = Thread(target=lambda: taken.append(camera.read()))
    thread.start()
    time.sleep(0.4)
    assert not taken
    write_video(device.with_name("right.mp4"), frames=2)
    device.with_name("right.mp4").rename(device)
    thread.join(2.0)
    assert taken[0] is not None
    assert ["stopped" in said[0], "96x64" in said[1], "is back" in said[2]] == [True] * 3
    assert len(said) == 3


def test_a_camera_that_stops_is_opened_again(device, capsys, monkeypatch):
    """While it is away nobody waits for it; closing it ends the waiting."""
    write_video(device, frames=3)
    camera = OpenedCamera("left", str(device), SIZE)
    numbers = [camera.read() for _ in range(7)]
    assert all(taken is not None for taken in numbers)
    err = capsys.readouterr().err
    assert "stopped; the others go on" in err
    assert "is back" in err
    monkeypatch.setattr("sogjax.realtime.opened_camera.TRIED_AGAIN", 60.0)
    thread = Thread(target=lambda: [camera.read() for _ in range(9)])
    thread.start()
    camera.close()
    thread.join(2.0)
    assert not thread.is_alive()
    camera.release()
