"""The page of a run: what stands on it, for every kind of run, and whether a real browser shows it without a fault."""

import json
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from browser import SIZES, Browser, faults_of
from command_line import actor_file, done, interrupt_at, trackable

from sogjax.cli.main import main
from sogjax.io.recording import open_recording
from sogjax.run.clip import Clip
from sogjax.run.page import changed_settings
from sogjax.run.small_pictures import SmallPictures
from sogjax.settings.compose import track_config
from sogjax.view.page.run_page import _fitting

FRAMES = 14
SMALL = ("images.depth=4", "solver.max_iterations=2", "solver.min_iterations=1")
LIGHT = (*SMALL, "outputs.overlay=false", "outputs.rerun=false")


def known_of(page):
    """What the page's script is told."""
    return json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])


@pytest.fixture(scope="module")
def tracked(tmp_path_factory):
    """A folder with a recording, its actor, and a run of them."""
    place = tmp_path_factory.mktemp("page")
    recording, actor = trackable(place / "walk", frames=FRAMES), actor_file(place / "a.yaml")
    words = ["track", f"recording={recording}", f"actor={actor}", *LIGHT]
    assert main([*words, f"out={place / 'run'}"]) == 0
    return place, words


@pytest.mark.slow
def test_a_run_writes_a_page_that_needs_nothing_beside_it(tracked):
    place, _ = tracked
    path = place / "run" / "index.html"
    page, note = path.read_text(), json.loads((place / "run" / "run.json").read_text())
    assert "index.html" in note["files"]
    assert path.stat().st_size < 10e6
    known = known_of(page)
    assert known["frames"] == list(range(FRAMES))
    assert [frame for frame, _ in known["pictures"]] == list(range(FRAMES))
    assert all(address.startswith("data:image/jpeg;base64,") for _, address in known["pictures"])
    verdict = json.loads((place / "run" / "metrics.json").read_text())["verdicts"]["puppet"]
    for finding in verdict["findings"]:
        assert finding.split(":")[0] in re.sub(r"<[^>]*>", "", page)
    for word in (
        "What to do",
        "images.depth",
        "solver.max_iterations",
        "jax 0.",
        "sogjax view motion=",
        "sogjax adjust",
    ):
        assert word in page
    assert not re.search(r'(src|href)="(?!data:|#)', page)
    assert not (place / "run" / "run.partial").exists()


@pytest.mark.slow
def test_no_page_where_none_is_asked_for(capsys, tracked, tmp_path):
    _, words = tracked
    for name, word in (("page", "outputs.page=false"), ("only", "outputs.motion_only=true")):
        done(capsys, *words, f"out={tmp_path / name}", word)
        assert not (tmp_path / name / "index.html").exists()


@pytest.mark.slow
def test_a_browser_shows_it_without_a_fault(tracked):
    place, _ = tracked
    assert faults_of(place / "run" / "index.html") == []


@pytest.mark.slow
def test_pictures_follow_clicks_keys_and_links(tracked):
    place, _ = tracked
    with Browser() as browser:
        browser.open(place / "run" / "index.html", SIZES["wide"], "light")
        frame, said = "+document.getElementById('frame').value", "document.getElementById('said').textContent"
        assert browser.value(frame) == 0
        browser.value("document.getElementById('frame').focus()")
        for _ in range(3):
            browser.press("ArrowRight", 39)
        assert browser.value(frame) == 3
        assert browser.value(said).startswith("Frame 3, 0.12 s")
        assert "frame 3" in browser.value("document.getElementById('screen').alt")
        box = "document.querySelector('.plot.large')"
        browser.value(f"{box}.scrollIntoView({{block: 'center'}})")
        left, top, width, height = browser.value(
            f"(b => [b.left, b.top, b.width, b.height])({box}.getBoundingClientRect())"
        )
        ends = [float(browser.value(f"{box}.dataset.{side}")) for side in ("left", "right")]
        place_of_10 = left + width * (ends[0] + (10.5 / FRAMES) * (ends[1] - ends[0]))
        browser.click(place_of_10, top + 0.5 * height)
        assert browser.value(frame) == 10
        cursor = browser.value(f"(b => b.left + b.width / 2)({box}.querySelector('.cursor').getBoundingClientRect())")
        assert cursor == pytest.approx(place_of_10, abs=2.0)
        browser.value("location.hash = '#frame=5'; new Promise((done) => setTimeout(done, 50))")
        assert browser.value(frame) == 5
        assert not browser.said


@pytest.mark.slow
def test_a_resumed_run_shows_the_frames_before_it_was_stopped(capsys, monkeypatch, tracked, tmp_path):
    _, words = tracked
    last = 10
    interrupt_at(monkeypatch, last)
    assert main([*words, f"out={tmp_path / 'run'}"]) == 130
    monkeypatch.undo()
    done(capsys, *words, f"out={tmp_path / 'run'}", "resume=true")
    known = known_of((tmp_path / "run" / "index.html").read_text())
    assert [frame for frame, _ in known["pictures"]] == list(range(FRAMES))


@pytest.mark.slow
def test_two_actors_have_a_timeline_each(capsys, tracked, tmp_path):
    place, words = tracked

    def ben(content):
        content["name"], content["blobs"][0]["sigma"] = "ben", 0.12

    other = actor_file(tmp_path / "b.yaml", ben)
    pose = (place / "walk" / "initial_pose.yaml").read_text()
    (tmp_path / "poses.yaml").write_text("".join(
        f"{name}:\n" + "".join(f"  {line}\n" for line in pose.replace("[0.0, 0.0", f"[{x}, 0.0").splitlines())
        for name, x in (("puppet", 0.0), ("ben", 0.8))
    ))  # fmt: skip
    actors = [word for word in words if not word.startswith("actor=")]
    actors += [f"actor=[{place / 'a.yaml'},{other}]", f"initial_pose={tmp_path / 'poses.yaml'}"]
    done(capsys, *actors, f"out={tmp_path / 'run'}", "stop=4")
    page = (tmp_path / "run" / "index.html").read_text()
    assert [actor["name"] for actor in known_of(page)["actors"]] == ["puppet", "ben"]
    assert page.count('class="plot large"') == 2
    assert faults_of(tmp_path / "run" / "index.html") == []


@pytest.mark.slow
def test_a_single_frame_of_which_nothing_is_judged(capsys, tracked, tmp_path):
    _, words = tracked
    done(capsys, *words, f"out={tmp_path / 'run'}", "start=3", "stop=4", "outputs.confidence=false")
    known = known_of((tmp_path / "run" / "index.html").read_text())
    assert (known["frames"], known["actors"][0]["explained"]) == ([3], None)
    assert faults_of(tmp_path / "run" / "index.html") == []


def test_only_settings_that_differ_are_told():
    assert changed_settings(track_config(recording="r")) == []
    found = changed_settings(track_config(["stop=40", "solver.max_iterations=9"], recording="r"))
    assert {key: (here, usual) for key, here, usual in found}["stop"] == ("40", "null")
    assert {key for key, _, _ in found} == {"stop", "solver.max_iterations"}


def test_fewer_pictures_where_they_would_be_too_large():
    drawn = [(frame, "x" * 100) for frame in range(32)]
    kept = _fitting(drawn, 1000)
    assert [frame for frame, _ in kept] == [0, 4, 8, 12, 16, 20, 24, 28]


@pytest.mark.slow
def test_small_pictures_are_taken_while_a_clip_is_decoded_and_outlive_the_process(tracked, tmp_path, monkeypatch):
    place, _ = tracked
    recording = open_recording(place / "walk")
    clip = Clip(recording, recording.frames, 4).shown_small(tmp_path, 5)
    assert len(list(clip.frames())) == FRAMES
    monkeypatch.setattr("sogjax.run.small_pictures.read_frames", None)  # nothing is read again
    again = SmallPictures(recording, clip.small.frames, clip.small.folder)
    again.read_lacking()
    for frame in again.frames:
        for camera, picture in enumerate(again.of_frame(frame)):
            assert abs(float(picture[:, : picture.shape[1] // 3].mean()) - (20 + 50 * camera)) < 6
            assert abs(float(picture[:, picture.shape[1] * 3 // 4 :].mean()) - (20 + 12 * frame)) < 6


@pytest.mark.slow
def test_small_pictures_that_no_pass_came_by_are_read(tracked):
    place, _ = tracked
    recording = open_recording(place / "walk")
    small = SmallPictures(recording, (2, 7))
    assert small.of_frame(2) == [None, None]
    small.read_lacking()
    assert all(picture.shape == (48, 64, 3) for picture in small.of_frame(7))
    large = np.zeros((1000, 2000, 3), np.uint8)
    other = replace(small, frames=(3,))
    other.take(0, 3, cv2.circle(large, (1000, 500), 100, (255, 255, 255), -1))
    assert other.of_frame(3)[0].shape == (320, 640, 3)
