"""A motion held against other systems' files: errors that were put in come out, whatever clock, rate and world."""

import dataclasses
import json

import ezc3d
import numpy as np
import pytest
from body_cases import shipped
from command_line import done, refused
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.io.export.angles import joint_angles, write_mot
from sogjax.io.export.bvh import write_bvh
from sogjax.io.export.points import write_c3d, write_trc
from sogjax.io.motion import motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.io.reference.load import load_reference
from sogjax.quality.angle_errors import angle_error, multiple_correlation
from sogjax.quality.reference.evaluation import evaluate_against_reference
from sogjax.quality.reference.time_offset import time_offset

DEGREES, METRES = 0.05, 1e-4


@pytest.fixture(scope="module")
def body():
    return shipped("human")


def moving(body, fps=50.0, seconds=2.4, begin=0.0):
    """A body that squats unevenly while it swings its arms and drifts; two rates show the same motion."""
    names = body.skeleton.dof_names
    t = begin + np.arange(round(seconds * fps)) / fps
    pose = np.zeros((len(t), body.skeleton.num_dofs), np.float32)
    for name, values in {
        "root_x": 0.2 * t,
        "root_yaw": 0.3 * t,
        "left_knee": 0.8 + 0.5 * np.sin(2.1 * t**1.3),
        "right_knee": 0.6 + 0.5 * np.sin(1.7 * t**1.4),
        "left_hip_bend": 0.5 + 0.4 * np.sin(2.1 * t**1.3),
        "right_hip_bend": 0.3 * np.sin(3.0 * t),
        "left_hip_side": 0.1 * np.cos(2.0 * t),
        "right_elbow": 0.7 + 0.6 * np.cos(2.6 * t),
        "left_shoulder_raise": 0.4 + 0.3 * np.sin(1.9 * t),
    }.items():
        pose[:, names.index(name)] = values
    return motion_from_poses(body, pose, fps)


@pytest.fixture(scope="module")
def motion(body):
    return moving(body)


def with_points(path, points, rate, labels):
    """A C3D file, written without this package: points in metres with z up."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["LABELS"]["value"] = labels
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    data = np.ones((4, points.shape[1], points.shape[0]))
    data[:3] = 1000.0 * points.transpose(2, 1, 0)
    file["data"]["points"] = data
    file.write(str(path))


@pytest.mark.parametrize(("ending", "write"), [("mot", write_mot), ("trc", write_trc), ("c3d", write_c3d)])
def test_our_own_files_are_read_back_without_error(motion, tmp_path, ending, write):
    write(tmp_path / f"a.{ending}", motion)
    found = evaluate_against_reference(motion, load_reference(tmp_path / f"a.{ending}"))
    assert found.offset == pytest.approx(0.0, abs=1e-3)
    assert found.num_frames == motion.num_frames
    assert max(each.mean_abs for each in found.angles) < DEGREES
    assert np.nanmax(found.joints.errors) < METRES


def test_a_bvh_in_another_world_has_the_angles_and_the_joints(motion, tmp_path):
    write_bvh(tmp_path / "a.bvh", motion, up="y")  # as if its vertical were another one: a turned world
    found = evaluate_against_reference(motion, load_reference(tmp_path / "a.bvh"), offset=0.0)
    assert {each.name for each in found.angles} == set(joint_angles(motion)) - {f"pelvis_t{axis}" for axis in "xyz"}
    assert max(each.mean_abs for each in found.angles if not each.name.startswith("pelvis")) < 0.2
    assert np.nanmean(found.joints.errors) > 0.5
    assert np.nanmax(found.placed.errors) < 5e-3


def test_an_error_that_was_put_into_a_mot_comes_out(motion, tmp_path):
    """An offset of 7 degrees, another range, and an angle that is counted the other way."""
    write_mot(tmp_path / "a.mot", motion)
    reference = load_reference(tmp_path / "a.mot")
    changed = {
        **reference.angles,
        "knee_angle_l": reference.angles["knee_angle_l"] - 7.0,
        "elbow_flex_r": 2.0 * reference.angles["elbow_flex_r"],
        "knee_angle_r": -reference.angles["knee_angle_r"],
    }
    found = evaluate_against_reference(motion, dataclasses.replace(reference, angles=changed), offset=0.0)
    errors = {each.name: each for each in found.angles}
    knee, elbow = errors["knee_angle_l"], errors["elbow_flex_r"]
    assert (knee.joint, knee.plane) == ("knee", "sagittal")
    assert knee.offset == pytest.approx(7.0, abs=DEGREES)
    assert knee.mean_abs_centred < DEGREES
    assert knee.range_ratio == pytest.approx(1.0, abs=0.01)
    assert elbow.range_ratio == pytest.approx(0.5, abs=0.01)
    assert errors["knee_angle_r"].mean_abs < DEGREES
    assert any("knee_angle_r" in note and "other way" in note for note in found.notes)


@pytest.mark.parametrize("late", [0.31, -0.22])
def test_another_clock_and_rate_are_found_and_said(body, motion, tmp_path, late):
    other = moving(body, fps=120.0, seconds=1.9, begin=0.25)
    write_mot(tmp_path / "a.mot", dataclasses.replace(other, time=other.time + late))
    found = evaluate_against_reference(motion, load_reference(tmp_path / "a.mot"))
    assert found.offset == pytest.approx(0.25 - late, abs=0.006)
    assert max(each.mean_abs for each in found.angles) < 0.5
    assert any("120 frames per second were resampled" in note for note in found.notes)


def test_points_of_a_laboratory_with_its_own_world_clock_and_gaps(body, motion, tmp_path):
    other = moving(body, fps=100.0, seconds=2.0, begin=0.2)
    names = {"RKnee": "right_knee", "lab:LKnee": "left_knee", "RHip": "right_hip", "LHip": "left_hip"}
    names |= {"RAnkle": "right_ankle", "LAnkle": "left_ankle", "Sacrum9": "pelvis"}
    points = np.stack([other.joint(name) for name in names.values()], axis=1).astype(float)
    points = points @ Rotation.from_euler("z", 40, degrees=True).as_matrix().T + [3.0, 1.0, 0.0]
    points[:30, 0] = np.nan
    with_points(tmp_path / "lab.c3d", points, 100.0, list(names))
    found = evaluate_against_reference(motion, load_reference(tmp_path / "lab.c3d"))
    assert found.offset == pytest.approx(0.2, abs=0.006)
    assert np.nanmean(found.joints.errors) > 1.0
    assert np.nanmean(found.placed.errors) < 2e-3
    knee = next(each for each in found.angles if each.name == "knee_l")
    assert knee.mean_abs < 0.5
    assert any("Sacrum9" in note for note in found.notes)
    assert not np.isfinite(found.joints.errors[5, found.joints.names.index("right_knee")])


def test_the_command_prints_degrees_and_writes_json(capsys, motion, tmp_path):
    save_motion(tmp_path / "motion.npz", motion)
    write_mot(tmp_path / "a.mot", motion)
    source, truth = f"motion={tmp_path / 'motion.npz'}", f"truth={tmp_path / 'a.mot'}"
    out, _ = done(capsys, "evaluate", source, truth, f"out={tmp_path / 'e.json'}")
    assert "knee sagittal" in out
    content = json.loads((tmp_path / "e.json").read_text())
    assert content["angles"]["by_plane"]["knee sagittal"]["cmc"] == pytest.approx(1.0, abs=1e-3)


def test_what_has_nothing_in_common_is_refused(capsys, motion, tmp_path):
    save_motion(tmp_path / "motion.npz", motion)
    source = f"motion={tmp_path / 'motion.npz'}"
    write_mot(tmp_path / "late.mot", dataclasses.replace(motion, time=motion.time + 60.0))
    assert "no time in common" in refused(capsys, "evaluate", source, f"truth={tmp_path / 'late.mot'}")
    done(capsys, "evaluate", source, f"truth={tmp_path / 'late.mot'}", "offset=-60")
    with_points(tmp_path / "other.c3d", np.zeros((50, 2, 3)), 50.0, ["Box1", "Box2"])
    assert "none of its names (Box1" in refused(capsys, "evaluate", source, f"truth={tmp_path / 'other.c3d'}")
    (tmp_path / "bad.trc").write_text("nothing\n")
    assert "is this a marker file" in refused(capsys, "evaluate", source, f"truth={tmp_path / 'bad.trc'}")
    assert "offset=" in refused(capsys, "evaluate", source, f"truth={tmp_path / 'motion.npz'}", "offset=1")


def test_a_dog_has_no_knee_angle_of_a_person(capsys, motion, tmp_path):
    dog = shipped("dog")
    poses = np.zeros((20, dog.skeleton.num_dofs), np.float32)
    save_motion(tmp_path / "motion.npz", motion_from_poses(dog, poses, 50.0))
    write_mot(tmp_path / "a.mot", motion)
    said = refused(capsys, "evaluate", f"motion={tmp_path / 'motion.npz'}", f"truth={tmp_path / 'a.mot'}")
    assert "none of its names" in said
    assert "dog" in said


def test_the_coefficient_of_multiple_correlation_by_hand():
    """Curves (0, 4) and (1, 5): 4 * 0.25 / 2 = 0.5 within, 2 * (6.25 + 2.25) / 3 = 17 / 3 in all."""
    one = np.array([0.0, 4.0])
    assert multiple_correlation(one, one + 1.0) ** 2 == pytest.approx(1.0 - 0.5 / (17.0 / 3.0))
    assert multiple_correlation(one, one) == 1.0
    assert np.isnan(multiple_correlation(one, one + 9.0))


def test_a_turn_more_is_no_error():
    ours = np.linspace(300.0, 380.0, 20)
    error = angle_error("knee_angle_r", ours, ours - 363.0)
    assert error.mean_abs == pytest.approx(3.0)
    assert error.range_ratio == pytest.approx(1.0)


def test_of_a_walk_that_repeats_itself_the_nearest_stride_is_taken():
    t = np.arange(0.0, 6.0, 0.02)
    wave = np.sin(2.0 * np.pi * t)
    offset, alike = time_offset([wave], t, [wave], t + 0.1)
    assert offset == pytest.approx(-0.1, abs=0.005)
    assert alike > 0.99


def test_a_heading_that_differs_by_half_a_turn_has_that_offset_and_no_other_error():
    """On either side of half a turn differences have opposite signs; one frame is a whole turn off besides."""
    true = np.linspace(-20.0, 20.0, 41)
    ours = true + 180.0 + np.where(np.arange(41) % 2, 1.0, -1.0)
    ours[20] += 360.0
    error = angle_error("pelvis_rotation", ours, true)
    assert error is not None
    assert abs(error.offset) == pytest.approx(180.0, abs=0.1)
    assert error.mean_abs_centred == pytest.approx(1.0, abs=0.05)
    assert error.range_ratio == pytest.approx(42.0 / 40.0, abs=0.06)


def test_who_turns_round_and_round_does_not_hide_the_offset():
    """The heading is as like itself at any lag; the knee tells."""
    t = np.arange(0.0, 4.0, 0.02)
    heading, knee = 300.0 * t, 30.0 * np.sin(2.1 * t**1.6)
    offset, alike = time_offset([heading, knee], t, [heading, knee], t + 2.3)
    assert offset == pytest.approx(-2.3, abs=0.005)
    assert alike > 0.999


def test_a_truth_with_nothing_but_gaps_is_refused(motion, tmp_path):
    write_mot(tmp_path / "a.mot", motion)
    reference = load_reference(tmp_path / "a.mot")
    unknown = {name: np.full_like(values, np.nan) for name, values in reference.angles.items()}
    with pytest.raises(InputError, match="fewer than two frames"):
        evaluate_against_reference(motion, dataclasses.replace(reference, angles=unknown, points={}))
