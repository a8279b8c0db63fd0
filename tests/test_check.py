"""`sogjax check`: a rendered recording has nothing wrong; each fault put into it is found, and named."""

import json
from dataclasses import replace

import cv2
import faulty_recording as faulty
import numpy as np
import pytest
import yaml
from browser import faults_of
from command_line import done, refused
from faulty_recording import OTHER, WRONG, copied
from rig_cases import ring_rig
from small_recording import make_recording, shared_recording, toml_camera, write_calibration

from sogjax.check.agreement import smallest_shift
from sogjax.check.appearance import exposure, exposure_findings
from sogjax.check.cameras import camera_findings, rig_geometry
from sogjax.check.examination import examined
from sogjax.check.motion import CameraMotion, barcodes, correlation, lag_curve
from sogjax.check.pictures import Moment
from sogjax.check.synchronisation import synchrony, synchrony_findings
from sogjax.errors import InputError
from sogjax.io.recording import open_recording
from sogjax.io.recording_settings import read_recording_settings, write_frame_offsets
from sogjax.scene.visual_hull import nearest_point


def looked_at(folder, change=None):
    """What a check finds after a change was made to a copy of the recording."""
    copied(folder)
    if change is not None:
        change(folder)
    return examined(open_recording(folder), 0, 40, 8, lambda items, count, label: iter(items))


def warnings(found, topic=None):
    """The warnings, of one topic or of all."""
    return [f for f in found.findings if f.severity == "warning" and topic in (None, f.topic)]


@pytest.mark.slow
def test_a_sound_recording_has_no_warning(tmp_path):
    found = looked_at(tmp_path / "walk")
    assert {finding.severity for finding in found.findings} == {"ok"}
    topics = {finding.topic for finding in found.findings}
    assert topics == {"files", "cameras", "frames", "synchronisation", "calibration", "unit", "exposure"}
    truth = np.load(tmp_path / "walk" / "ground_truth.npz")
    standing = np.ptp(truth["markers"][..., 2], axis=1).mean()
    assert found.numbers["subject"]["height"] == pytest.approx(standing, rel=0.15)
    assert not found.offsets
    json.dumps(found.numbers)


@pytest.mark.slow
def test_a_camera_that_started_three_frames_late(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.started_late)
    (finding,) = warnings(found)
    assert finding.topic == "synchronisation"
    assert finding.cameras == (WRONG,)
    assert found.offsets == {f"cam{k:02d}": -3 * (f"cam{k:02d}" == WRONG) for k in range(6)}


@pytest.mark.slow
def test_exchanged_videos(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.exchanged_videos)
    assert [finding.cameras for finding in warnings(found, "files")] == [(WRONG, OTHER)]
    assert len(warnings(found)) == 1


@pytest.mark.slow
def test_exchanged_calibrations(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.exchanged_calibration)
    assert (WRONG, OTHER) in [tuple(sorted(finding.cameras)) for finding in warnings(found, "calibration")]


@pytest.mark.slow
def test_a_camera_that_was_turned_by_five_degrees(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.turned)
    assert {finding.cameras for finding in warnings(found)} == {(WRONG,)}
    assert {finding.topic for finding in warnings(found)} == {"calibration"}
    assert found.numbers["silhouettes"][WRONG]["away"] == pytest.approx(5.0, abs=0.7)


@pytest.mark.slow
def test_a_mirrored_world(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.mirrored)
    assert ["mirrored" in finding.what for finding in warnings(found)] == [True]


@pytest.mark.slow
def test_millimetres_taken_for_metres(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.in_millimetres)
    (finding,) = [f for f in found.findings if f.severity not in ("ok", "note")]
    assert (finding.severity, finding.topic) == ("error", "unit")
    assert "unit: mm" in finding.remedy
    assert found.numbers["subject"]["height"] == pytest.approx(1700, rel=0.15)


@pytest.mark.slow
def test_a_wrong_vertical(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.wrong_vertical)
    assert ["`up: z`" in finding.remedy for finding in warnings(found)] == [True]


@pytest.mark.slow
def test_a_frame_that_stands_twice(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.frame_repeated)
    assert [(finding.topic, finding.cameras) for finding in warnings(found)] == [("frames", (WRONG,))]
    assert found.numbers["repeated_frames"] == {WRONG: [20]}


@pytest.mark.slow
def test_a_frame_that_was_lost(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.frame_lost)
    notes = [finding for finding in found.findings if finding.severity == "note" and finding.topic == "frames"]
    assert any(f"{WRONG} 39" in finding.what for finding in notes)
    assert any("lost 1 frame" in finding.what and finding.cameras == (WRONG,) for finding in notes)
    assert not found.offsets


@pytest.mark.slow
def test_a_camera_exposed_otherwise(tmp_path):
    found = looked_at(tmp_path / "walk", faulty.darkened)
    assert {(finding.topic, finding.cameras) for finding in warnings(found)} == {("exposure", (WRONG,))}


def left_out(folder, camera, *spans):
    """A camera whose pictures are not to be used in some frames."""
    path = folder / "recording.yaml"
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | {"missing": {camera: [list(s) for s in spans]}}))


@pytest.mark.slow
def test_missing_pictures_are_left_out_of_every_comparison(tmp_path):
    """A late start, a gap that holds both stills, and nothing is wrong; in a shorter one offsets are sure as ever."""
    found = looked_at(tmp_path / "walk", lambda folder: left_out(folder, WRONG, (0, 1), (13, 26)))
    assert not warnings(found)
    assert not found.offsets
    assert found.numbers["repeated_frames"] == {}
    assert any(f.topic == "frames" and f"{WRONG} in 16" in f.what for f in found.findings)
    assert not found.pictures[int(WRONG[-2:])].any()

    def late(folder):
        faulty.started_late(folder)
        left_out(folder, OTHER, (12, 16))

    found = looked_at(tmp_path / "late", late)
    assert [(finding.topic, finding.cameras) for finding in warnings(found)] == [("synchronisation", (WRONG,))]
    assert {name: offset for name, offset in found.offsets.items() if offset} == {WRONG: -3}
    assert found.numbers["synchronisation"][OTHER]["sure"]


@pytest.mark.slow
def test_a_camera_with_hardly_a_picture_is_not_said_to_be_out_of_step(tmp_path):
    found = looked_at(tmp_path / "walk", lambda folder: left_out(folder, WRONG, (4, 39)))
    assert not warnings(found)
    assert not [finding for finding in found.findings if finding.severity == "note" and finding.topic != "frames"]


def test_steps_that_one_camera_has_not_seen_do_not_count():
    rng = np.random.default_rng(2)
    a, b = rng.random((30, 8)), rng.random((30, 8))
    b[:20] += a[:20]
    gone = rng.permutation(30)[:12]
    partly = b.copy()
    partly[gone] = np.nan
    rest = np.delete(np.arange(30), gone)
    assert correlation(a, partly) == pytest.approx(correlation(a[rest], b[rest]))
    partly[rest[4:]] = np.nan
    assert correlation(a, partly) == 0.0


@pytest.mark.slow
def test_a_clip_that_is_too_short_is_said_to_be_so(tmp_path):
    """One frame of those that are there, and all of a recording that has few."""
    recording = open_recording(copied(tmp_path / "walk"))
    for have, frames, words in ((recording, 8, "give frames=9"), (replace(recording, num_frames=1), 9, "record more")):
        told = examined(have, 0, frames, 8, lambda items, count, label: iter(items)).findings
        (note,) = (finding for finding in told if finding.topic == "synchronisation")
        assert f"too short, {min(have.num_frames, frames)} frame" in note.what
        assert "of 9 needed" in note.what
        assert words in note.remedy


def test_exposure_compares_those_whose_subject_is_known():
    """Four cameras show the same subject before walls of other brightness; where it is in the last one is not known."""
    mask = np.zeros((20, 30), bool)
    mask[5:15, 10:20] = True
    levels, walls = (100, 100, 60, 100), (10, 200, 90, 240)
    pictures = {k: np.where(mask[..., None], level, wall).astype(np.uint8) + np.zeros((20, 30, 3), np.uint8)
                for k, (level, wall) in enumerate(zip(levels, walls, strict=True))}  # fmt: skip
    found = exposure([Moment(pictures, dict.fromkeys(range(3), mask))], 4)
    assert found.of_subject
    np.testing.assert_allclose(found.gains, [[1.0] * 3, [1.0] * 3, [0.6] * 3, [np.nan] * 3])
    (finding,) = exposure_findings(("a", "b", "c", "d"), found, "example poses")
    assert finding.cameras == ("c",)
    assert not exposure([Moment(pictures, dict.fromkeys(range(2), mask))], 4).of_subject


@pytest.mark.slow
@pytest.mark.parametrize("name", ["real_tpose"])
def test_nearly_still_pictures_give_no_offsets(name):
    path = shared_recording(name)
    if path is None:
        pytest.skip("the recording is not there")
    found = examined(open_recording(path), 0, 11, 8, lambda items, count, label: iter(items))
    assert not warnings(found)
    assert not found.offsets
    assert any("cannot be estimated" in finding.what for finding in found.findings)


@pytest.mark.slow
def test_the_command_writes_numbers_and_picture_and_offsets_only_when_asked(capsys, tmp_path):
    recording = copied(tmp_path / "walk")
    faulty.started_late(recording)
    settings = recording / "recording.yaml"
    before = "# measured by hand\n" + settings.read_text()
    settings.write_text(before)
    out, _ = done(capsys, "check", f"recording={recording}", f"out={tmp_path / 'out'}", "frames=30")
    assert f'frame_offset: {{"{WRONG}": -3}}' in out.splitlines()
    assert settings.read_text() == before
    assert json.loads((tmp_path / "out" / "check.json").read_text())["synchronisation"][WRONG]["offset"] == -3
    page = (tmp_path / "out" / "index.html").read_text()
    assert "frame_offset" in page
    assert faults_of(tmp_path / "out" / "index.html") == []

    _, err = done(capsys, "check", f"recording={recording}", f"out={tmp_path / 'out'}", "frames=30", "write=true")
    assert ".old" in err
    assert settings.read_text().startswith("# measured by hand")
    assert yaml.safe_load(settings.read_text()) == {**yaml.safe_load(before), "frame_offset": {WRONG: -3}}
    assert (recording / "recording.yaml.1.old").read_text() == before


def test_every_file_that_is_wrong_is_named(capsys, tmp_path):
    recording = make_recording(tmp_path / "two")
    (recording / "videos" / "left.mp4").write_bytes(b"no video" * 100)
    (recording / "initial_pose.yaml").write_text("pose: [1]\n")
    from sogjax.cli.main import main

    assert main(["check", f"recording={recording}", f"out={tmp_path / 'out'}"]) == 2
    out, err = capsys.readouterr()
    assert "left.mp4" not in err  # once is enough
    assert ["left.mp4" in line or "initial_pose.yaml" in line for line in out.splitlines()] == [True, True]
    assert all(line.startswith("error") for line in out.splitlines())
    assert not (tmp_path / "out").exists()


def test_options_out_of_range_are_refused(capsys, tmp_path):
    recording = make_recording(tmp_path / "two")
    for word in ("frames=0", "largest_offset=-1", "start=4", "cameras=[third]"):
        assert word.partition("=")[2].strip("[]") in refused(capsys, "check", f"recording={recording}", word)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("", 'frame_offset: {"a": 2}\n'),
        ("fps: 30\n", 'fps: 30\nframe_offset: {"a": 2}\n'),
        ("frame_offset:\n  a: 1\n  b: 3\nfps: 30 # so\n", 'frame_offset: {"a": 2}\nfps: 30 # so\n'),
        ("fps: 30\nframe_offset: {a: 1} # old\n", 'fps: 30\nframe_offset: {"a": 2} # old\n'),
    ],
)
def test_offsets_are_put_into_the_file_and_the_rest_stays(tmp_path, before, after):
    path = tmp_path / "recording.yaml"
    path.write_text(before)
    write_frame_offsets(path, {"a": 2})
    assert read_recording_settings(path).frame_offset == {"a": 2}
    assert [line for line in path.read_text().splitlines() if line] == after.splitlines()


def test_a_recording_written_in_braces_is_left_alone(tmp_path):
    path = tmp_path / "recording.yaml"
    path.write_text("{fps: 30}\n")
    with pytest.raises(InputError, match="braces"):
        write_frame_offsets(path, {"a": 2})
    assert path.read_text() == "{fps: 30}\n"


def test_places_heights_and_fields_of_view_of_a_ring():
    rig = ring_rig(4, distance=3.0)
    geometry = rig_geometry(rig, "z")
    for name, centre, forward in zip(rig.names, geometry.centres, geometry.forwards, strict=True):
        pose = np.asarray(rig.camera(name).camera_from_world, float)
        np.testing.assert_allclose(pose @ np.append(centre, 1.0), [0, 0, 0, 1], atol=1e-5)
        np.testing.assert_allclose(pose[:3, :3] @ forward, [0, 0, 1], atol=1e-5)
    half = np.deg2rad(geometry.fields[0, 0]) / 2
    matrix = np.asarray(rig.camera(rig.names[0]).intrinsics, float)
    assert np.tan(half) * matrix[0, 0] == pytest.approx(160)
    np.testing.assert_allclose(geometry.baselines[0, 1], np.linalg.norm(geometry.centres[0] - geometry.centres[1]))


def test_the_point_nearest_to_rays_is_where_they_meet():
    rng = np.random.default_rng(0)
    meeting, directions = rng.normal(size=3), rng.normal(size=(5, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    centres = meeting - directions * rng.uniform(1, 4, (5, 1))
    np.testing.assert_allclose(nearest_point(centres, directions), meeting, atol=1e-9)


def test_inverse_poses_are_recognised(tmp_path):
    tables = []
    for k, angle in enumerate((0.0, 2.0, 4.0)):
        centre = np.array([4 * np.cos(angle), 4 * np.sin(angle), 1.5])
        forward = -centre / np.linalg.norm(centre)
        right = np.cross(forward, [0, 0, 1.0])
        right /= np.linalg.norm(right)
        world_from_camera = np.stack([right, np.cross(forward, right), forward], axis=1)
        vector = cv2.Rodrigues(world_from_camera)[0].ravel().tolist()
        tables.append(toml_camera(f"c{k}", rotation=str(vector), translation=str(centre.tolist())))
    from sogjax.io.calibration.load import load_calibration

    rig = load_calibration(write_calibration(tmp_path, *tables))
    found = camera_findings(rig, rig_geometry(rig, "z"), "z")
    assert any("camera to world" in finding.cause for finding in found)


@pytest.mark.slow
def test_cameras_that_look_backwards_are_recognised(tmp_path):
    recording = copied(tmp_path / "walk")
    faulty.looking_backwards(recording)
    rig = open_recording(recording).rig
    (finding,) = camera_findings(rig, rig_geometry(rig, "z"), "z")
    assert "OpenGL" in finding.cause


def test_points_that_move_in_space_give_both_cameras_the_same_barcode():
    """Rays towards points of space, in two cameras anywhere: each plane through both holds the same points."""
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.5, 0.5, (400, 3))
    energy = rng.random((30, 400)).astype(np.float32)
    motions = []
    for centre in (np.array([4.0, 0.0, 1.0]), np.array([0.5, -4.0, 2.0])):
        rays = points - centre
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        motions.append(CameraMotion(energy, rays, centre))
    first, second = barcodes(*motions)
    assert correlation(first, second) == pytest.approx(1.0, abs=0.05)
    late = np.roll(second, -4, axis=0)  # the second camera shows what happens four steps earlier in its file
    assert int(lag_curve(first, late, 8).argmax()) - 8 == 4
    found = synchrony(("a", "b", "c"), {(0, 1): (first, late), (0, 2): (first, second), (1, 2): (late, second)}, 30, 8)
    assert found.offsets.tolist() == [0, -4, 0]
    assert found.sure.all()


@pytest.mark.parametrize(("seconds", "sure"), [(1.0, True), (6.0, False)])
def test_an_offset_of_one_frame_is_told_by_what_moves_fast(seconds, sure):
    """Of three cameras, one a frame early, that see the same patterns come and go in a time."""
    times, phases = np.arange(60)[:, None], np.random.default_rng(0).uniform(0.0, 6.0, 40)
    code = np.sin(2.0 * np.pi * times / seconds / 8.0 + phases).astype(np.float32)
    early = np.roll(code, -1, axis=0)
    early[-1] = code[-1]
    found = synchrony(("a", "b", "c"), {(0, 1): (code, early), (0, 2): (code, code), (1, 2): (early, code)}, 60, 3)
    assert found.offsets.tolist() == [0, -1, 0]
    found = replace(found, sure=np.array([True, found.sure[1], True]))
    assert found.sure[1] == sure
    said = synchrony_findings(found, {"a": 0, "b": 0, "c": 0}, moving=True)[0].what
    assert ("b shows everything 1 frame earlier" in said) == sure
    assert ("the motion in b fits that of the others as well a frame later or earlier" in said) != sure


def test_the_smallest_shift_brings_a_mask_into_a_larger_region():
    region, mask = np.zeros((120, 160), bool), np.zeros((120, 160), bool)
    region[30:90, 60:100] = True
    mask[40:80, 70:90] = True
    assert smallest_shift(mask, region) == 0.0
    assert smallest_shift(np.roll(mask, 30, axis=1), region) == pytest.approx(20.0, abs=3.0)
