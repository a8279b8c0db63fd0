"""The filter after tracking: what it keeps, what it takes away, and where it is said."""

from dataclasses import replace
from itertools import pairwise

import ezc3d
import numpy as np
import pytest
from body_cases import shipped
from command_line import actor_file, done, refused, trackable
from motion_cases import walking_motion
from synth_people import motions, person

from sogjax.cli.main import main
from sogjax.errors import InputError
from sogjax.io.export.write import export_motion
from sogjax.io.motion import load_motion, motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.run import passes
from sogjax.run.filter import check_cutoff, filter_name, smooth
from sogjax.synth.landmarks import LANDMARKS, landmark_points

FPS, CUTOFF = 50.0, 6.0
LENGTHS = np.array([True])
UPPER, LOWER = (("hip", "knee"), ("shoulder", "elbow")), (("knee", "ankle"), ("elbow", "wrist"))
SMALL = ("images.depth=4", "solver.max_iterations=2", "solver.min_iterations=1", "outputs.bvh=false")
LIGHT = (*SMALL, "outputs.overlay=false", "outputs.rerun=false", "outputs.page=false")


def test_half_of_the_power_is_left_at_the_cut_off_and_nothing_is_late():
    """Against the closed form of a Butterworth filter of second order, gone through twice."""
    times = np.arange(400) / FPS
    middle = slice(100, 300)
    warped = lambda hertz: np.tan(np.pi * hertz / FPS)
    for hertz in (1.0, 3.0, CUTOFF, 9.0, 15.0):
        wave = np.sin(2.0 * np.pi * hertz * times)[:, None]
        found = smooth(wave, CUTOFF, FPS, ~LENGTHS)
        gain = np.sum(found[middle] * wave[middle]) / np.sum(wave[middle] ** 2)
        ratio = warped(hertz) / warped(CUTOFF) * (np.sqrt(2.0) - 1.0) ** 0.25
        assert gain == pytest.approx(1.0 / (1.0 + ratio**4), abs=5e-3)
        assert np.abs(found[middle] - gain * wave[middle]).max() < 1e-2  # the same phase
    assert 1.0 / (1.0 + (np.sqrt(2.0) - 1.0)) == pytest.approx(1.0 / np.sqrt(2.0))


def test_angles_go_the_shorter_way():
    turned = np.linspace(2.0, 5.0, 100)
    jumping = np.stack([np.where(turned > np.pi, turned - 2.0 * np.pi, turned), turned], axis=1)
    found = smooth(jumping, CUTOFF, FPS, np.array([True, False]))
    np.testing.assert_allclose(np.diff(found[:, 0]), np.diff(found[:, 1]), atol=1e-6)
    assert np.abs(np.diff(smooth(jumping, CUTOFF, FPS, np.array([False, False]))[:, 0])).max() > 0.5


def test_a_straight_way_and_few_frames_stay():
    line = np.linspace(0.0, 2.0, 60)[:, None]
    np.testing.assert_allclose(smooth(line, CUTOFF, FPS, ~LENGTHS), line, atol=1e-6)
    for count in range(1, 8):
        few = np.ones((count, 2), np.float32)
        np.testing.assert_allclose(smooth(few, CUTOFF, FPS, np.array([True, False])), few, atol=1e-6)


@pytest.mark.slow
def test_a_walk_keeps_its_range_of_motion():
    """Angles at knees, elbows and hips of the rendered walk, over its steady part."""
    names, times = list(LANDMARKS), np.arange(0.0, 5.0, 1.0 / FPS)
    places = np.stack([landmark_points(person(0).anatomy, motions("walk")[0](float(t))) for t in times])
    place = lambda name: places[:, names.index(name)]
    across = _unit(place("left_hip") - place("right_hip"))
    down = np.tile([0.0, 0.0, -1.0], (len(places), 1))
    for side in ("left", "right"):
        thigh, upper_arm = (_unit(place(f"{side}_{b}") - place(f"{side}_{a}")) for a, b in UPPER)
        shank, forearm = (_unit(place(f"{side}_{b}") - place(f"{side}_{a}")) for a, b in LOWER)
        kept = {"shoulder": (down, upper_arm), "elbow": (upper_arm, forearm), "knee": (thigh, shank)}
        for name, (above, below) in (kept | {"thigh": (down, thigh)}).items():
            turned = np.sum(np.cross(above, below) * across, axis=1)  # signed: a straight knee is no edge
            angle = np.arctan2(turned, np.sum(above * below, axis=1))[:, None]
            after, steady = smooth(angle, CUTOFF, FPS, LENGTHS), slice(50, -25)
            most = 0.02 if name in kept else 0.022  # the rendered thigh turns back within a few frames
            assert np.ptp(after[steady]) / np.ptp(angle[steady]) == pytest.approx(1.0, abs=most), (side, name)


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_standing_still_jitters_less():
    """Where joints are, in mm from frame to frame, of a person who stands with noise of half a degree and 2 mm."""
    human, rng = shipped("human"), np.random.default_rng(0)
    turns = human.skeleton.turning
    noise = rng.normal(size=(120, len(turns))) * np.where(turns, np.radians(0.5), 0.002)
    poses = (np.asarray(human.poses["rest"]) + noise).astype(np.float32)
    after = smooth(poses, CUTOFF, FPS, turns)
    assert after.dtype == poses.dtype
    before, now = (_jitter(motion_from_poses(human, each, FPS)) for each in (poses, after))
    assert before > 4.0
    assert now < 0.25 * before


def _jitter(motion):
    steps = np.diff(motion.world_from_joint[:, :, :3, 3], axis=0)
    return 1000.0 * float(np.linalg.norm(steps, axis=-1).mean())


@pytest.mark.parametrize("cutoff", [12.0, 12.5, 40.0, 0.0, -1.0, float("nan")])
def test_a_cut_off_that_cannot_be(cutoff):
    with pytest.raises(InputError, match=r"outputs\.filter="):
        check_cutoff(cutoff, 25.0)
    check_cutoff(11.0, 25.0)
    check_cutoff(None, 25.0)


@pytest.fixture(scope="module")
def command(tmp_path_factory):
    place = tmp_path_factory.mktemp("filter")
    recording, actor = trackable(place / "walk", frames=14), actor_file(place / "a.yaml")
    return ["track", f"recording={recording}", f"actor={actor}", *LIGHT]


def test_the_command_refuses_it_before_any_work(capsys, tmp_path, command):
    sentence = refused(capsys, *command, f"out={tmp_path / 'run'}", "outputs.filter=12")
    assert "outputs.filter=12: is too near 12.5 Hz" in sentence
    assert "6.25 Hz" in refused(capsys, *command, f"out={tmp_path / 'run'}", "outputs.filter=6", "every=2")
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_files_show_the_filtered_motion_and_keep_what_it_was(capsys, tmp_path, monkeypatch, command):
    done(capsys, *command, f"out={tmp_path / 'plain'}")
    done(capsys, *command, f"out={tmp_path / 'run'}", "outputs.filter=4", "outputs.formats=[trc,csv]")
    plain, found = (load_motion(tmp_path / name / "motion.npz") for name in ("plain", "run"))
    assert (plain.filtered_by, plain.unfiltered_pose) == ("", None)
    assert found.filtered_by == filter_name(4.0) == "Butterworth low-pass, order 4, zero phase, 4 Hz"
    np.testing.assert_array_equal(found.unfiltered_pose, plain.pose)
    turns = np.array([False, False, False, True, True])
    np.testing.assert_allclose(found.pose, smooth(plain.pose, 4.0, 25.0, turns), atol=1e-6)
    for name in ("motion.trc", "motion.csv"):
        assert f"filter: {found.filtered_by}" in (tmp_path / "run" / name).read_text().splitlines()[0]
    np.testing.assert_array_equal(found.of_rows(slice(2, 5)).unfiltered_pose, plain.pose[2:5])

    monkeypatch.setattr(passes, "filter_frames", lambda *_: (_ for _ in ()).throw(InputError("stopped")))
    refused_words = [*command, f"out={tmp_path / 'again'}", "outputs.filter=4"]
    assert main(refused_words) == 2
    monkeypatch.undo()
    assert "outputs.filter" in _last_line(capsys, [*refused_words[:-1], "outputs.filter=5", "resume=true"])
    done(capsys, *refused_words, "resume=true")
    again = load_motion(tmp_path / "again" / "motion.npz")
    np.testing.assert_array_equal(again.pose, found.pose)
    np.testing.assert_array_equal(again.unfiltered_pose, found.unfiltered_pose)


def _last_line(capsys, words):
    assert main(words) == 2
    return capsys.readouterr().err.splitlines()[-1]


def test_the_filter_stands_in_the_headers(tmp_path):
    motion = replace(walking_motion(), filtered_by=filter_name(6.0))
    export_motion(motion, tmp_path / "walk.c3d")
    parameters = ezc3d.c3d(str(tmp_path / "walk.c3d"))["parameters"]
    assert parameters["PROCESSING"]["FILTER"]["value"] == [filter_name(6.0)]
    human = shipped("human")
    rest = np.tile(np.asarray(human.poses["rest"]), (6, 1))
    standing = motion_from_poses(human, rest, FPS, unfiltered_pose=rest)
    export_motion(replace(standing, filtered_by=filter_name(6.0)), tmp_path / "stand.mot")
    header = (tmp_path / "stand.mot").read_text().partition("endheader")[0].splitlines()
    assert f"filter={filter_name(6.0)}" in header
    save_motion(tmp_path / "stand.npz", replace(standing, filtered_by="something"))
    read = load_motion(tmp_path / "stand.npz")
    assert read.filtered_by == "something"
    np.testing.assert_array_equal(read.unfiltered_pose, rest)


def test_the_filter_comes_after_every_pass_that_moves_frames():
    names = [each.name for each in passes.PASSES]
    assert all(names.index(a) < names.index(b) for a, b in pairwise(("tracked", "merged", "adjusted", "filtered")))
    assert names.index("filtered") < names.index("result")
