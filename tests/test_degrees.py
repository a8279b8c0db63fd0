"""Degrees by joint and plane over runs: what was put into a truth comes out, with joint angles and without."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from body_cases import shipped
from degrees import RunAngles, angles_of_run, degrees_tables, truths_of

from sogjax.errors import InputError
from sogjax.io.export.angles import joint_angles
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import motion_from_poses
from sogjax.quality.evaluation import evaluate_motion
from sogjax.study.experiment import Experiment, ExperimentConfig, RowConfig
from sogjax.study.record import RunRecord
from sogjax.study.summary import summarized
from sogjax.study.table import degrees_table

DEGREES = 0.05


@pytest.fixture(scope="module")
def squatting():
    """A right knee that bends 60 degrees, and how it looks bent 5 degrees more."""
    body = shipped("human")
    pose = np.zeros((31, body.skeleton.num_dofs), np.float32)
    knee = body.skeleton.dof_names.index("right_knee")
    pose[:, knee] = np.deg2rad(20.0 + np.linspace(0.0, 60.0, 31))
    more = pose.copy()
    more[:, knee] += np.deg2rad(5.0)
    return motion_from_poses(body, pose, 25.0), motion_from_poses(body, more, 25.0)


def truth_of(motion, names, with_angles):
    angles = {name: values for name, values in joint_angles(motion).items() if not name.startswith("pelvis_t")}
    return GroundTruth(
        fps=25.0,
        joints=np.stack([motion.joint(name.replace("r_", "right_")) for name in names], axis=1),
        joint_names=tuple(names),
        angles=np.stack([*angles.values()], axis=1) if with_angles else None,
        angle_names=tuple(angles) if with_angles else (),
    )


def test_angles_of_a_truth_are_compared_by_name(squatting):
    motion, true = squatting
    errors = {each.name: each for each in evaluate_motion(motion, truth_of(true, ["r_knee"], True)).angles}
    assert errors["knee_angle_r"].offset == pytest.approx(-5.0, abs=DEGREES)
    assert errors["knee_angle_r"].range_ratio == pytest.approx(1.0, abs=0.01)
    assert errors["knee_angle_l"].mean_abs < DEGREES


def test_without_them_the_lines_between_its_joints_are(squatting):
    """A knee that is bent more has the smaller angle between thigh and shank."""
    motion, true = squatting
    (knee,) = evaluate_motion(motion, truth_of(true, ["r_hip", "r_knee", "r_ankle", "r_wrist"], False)).angles
    assert (knee.name, knee.joint, knee.plane) == ("knee_r", "knee", "between bones")
    assert knee.offset == pytest.approx(5.0, abs=DEGREES)
    assert knee.mean_abs_centred < DEGREES


def test_a_table_for_each_number_of_cameras(squatting, tmp_path):
    motion, true = squatting
    by_name, by_lines = (
        evaluate_motion(motion, truth_of(true, ["r_hip", "r_knee", "r_ankle"], with_angles)).angles
        for with_angles in (True, False)
    )
    runs = [RunAngles(tmp_path / "few", 4, by_name, 12.0), RunAngles(tmp_path / "many", 12, by_name, 9.0)]
    tables = degrees_tables([*runs, RunAngles(tmp_path / "older", 12, by_lines, 9.0)]).split("\n\n")
    assert [table.splitlines()[0].split(" (")[0] for table in tables] == [
        "12 cameras: many",
        "12 cameras: older",
        "4 cameras: few",
    ]
    assert "knee sagittal" in tables[0]
    assert "the truth has no others" in tables[1]


def test_what_is_no_run_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"holds no config\.yaml"):
        angles_of_run(tmp_path)
    with pytest.raises(InputError, match="1 for 2 runs"):
        truths_of(["a", "b"], ["c"])


def test_the_reports_table_has_a_row_for_each_joint_and_plane(squatting):
    """Two recordings of a row are averaged; what has no joint angles is left out."""
    motion, true = squatting
    angles = evaluate_motion(motion, truth_of(true, ["r_hip", "r_knee", "r_ankle"], True)).angles
    lines = evaluate_motion(motion, truth_of(true, ["r_hip", "r_knee", "r_ankle"], False)).angles
    twice = [replace(error, mean_abs_centred=4.0) if error.joint == "knee" else error for error in angles]
    record = lambda errors: RunRecord({}, "here", frame=[0], error_mm=[1.0], angles=[asdict(each) for each in errors])
    rows = {"12": {"walk": record(angles), "run": record(twice)}, "4": {"walk": record(lines)}}
    config = ExperimentConfig(title="T", question="Q?", axis="cameras", reference="12", rows={"12": RowConfig()})
    found = summarized(rows, "12", dict.fromkeys(rows, ("", None)))
    table = degrees_table(Experiment("small", config), found).splitlines()
    assert table[0].endswith("| 12 |")
    assert "| knee sagittal | 2.0 (1.00) |" in table
