"""One cause is named once; a unit that is far off is refused before anything heavy; what a lens model bends back."""

from dataclasses import replace

import cv2
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from command_line import actor_file, refused, trackable
from drawn_scene import draw, in_colors, standing
from rig_cases import opencv_pixels, recording_of, ring_rig
from small_recording import make_recording, toml_camera, write_calibration

from sogjax.check.agreement import Misfit
from sogjax.check.calibration import _slightly_turned, calibration_findings, unit_rig
from sogjax.check.cameras import rig_geometry
from sogjax.check.examination import opening_problems
from sogjax.check.motion import motion_of, pair_barcodes
from sogjax.check.pictures import Clip, Moment
from sogjax.check.scale import SubjectSize, implausible_distance, scale_findings
from sogjax.cli.main import main
from sogjax.cli.schemas import SCHEMAS
from sogjax.cli.words import composed
from sogjax.errors import InputError
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.recording import open_recording
from sogjax.view.projection import picture_points, unfolded_radii

LEFT = "[1.2, -0.5, 0.3]"
RIGHT = "[1.2, 0.5, 0.3]"


def far_away(folder, metres):
    """A recording whose two cameras look from `metres` at a point between them."""
    recording = trackable(folder)
    tables = [
        toml_camera(name, rotation=turn, translation=f"[0.0, 0.0, {metres}]")
        for name, turn in (("left", LEFT), ("right", RIGHT))
    ]
    write_calibration(recording, *tables)
    return recording


def easymocap(recording):
    """A calibration in place of the recording's that does not say how large the pictures are."""
    (recording / "calibration.toml").unlink()
    matrix = np.array([[60.0, 0.0, 31.5], [0.0, 60.0, 23.5], [0.0, 0.0, 1.0]])
    intrinsic = cv2.FileStorage(str(recording / "intri.yml"), cv2.FILE_STORAGE_WRITE)
    extrinsic = cv2.FileStorage(str(recording / "extri.yml"), cv2.FILE_STORAGE_WRITE)
    intrinsic.startWriteStruct("names", cv2.FileNode_SEQ)
    for name in ("left", "right"):
        intrinsic.write("", name)
    intrinsic.endWriteStruct()
    for name in ("left", "right"):
        intrinsic.write(f"K_{name}", matrix)
        intrinsic.write(f"dist_{name}", np.zeros((5, 1)))
        extrinsic.write(f"R_{name}", np.array([[1.2], [-0.5], [0.3]]))
        extrinsic.write(f"T_{name}", np.array([[0.1], [0.2], [3.0]]))
    intrinsic.release()
    extrinsic.release()


def test_a_calibration_without_sizes_is_not_blamed_for_a_video_that_is_missing(tmp_path):
    recording = make_recording(tmp_path / "two")
    easymocap(recording)
    (recording / "recording.yaml").write_text("cameras: [left, right]\n")
    (recording / "background").mkdir()
    cv2.imwrite(str(recording / "background" / "right.png"), np.zeros((48, 64, 3), np.uint8))
    (recording / "videos" / "right.mp4").unlink()
    with pytest.raises(InputError) as error:
        open_recording(recording)
    (problem,) = opening_problems(recording, error.value)
    assert "right" in problem.what
    assert "how large" not in problem.what


@pytest.mark.parametrize(("metres", "remedy"), [(4000.0, "unit: mm"), (0.004, "metres"), (60.0, "metres")])
def test_tracking_at_an_implausible_scale_is_refused_with_the_remedy(capsys, tmp_path, metres, remedy):
    recording = far_away(tmp_path / "far", metres)
    actor = actor_file(tmp_path / "actor.yaml")
    assert main(["track", f"recording={recording}", f"actor={actor}", f"out={tmp_path / 'out'}"]) == 2
    sentence = capsys.readouterr().err.splitlines()[-1]  # after a warning that cameras stand far from the origin
    assert remedy in sentence
    assert "from what they look at" in sentence
    assert not (tmp_path / "out").exists()


def test_making_an_actor_at_an_implausible_scale_is_refused(capsys, tmp_path):
    recording = far_away(tmp_path / "far", 0.004)
    sentence = refused(capsys, "actor", f"recording={recording}", f"out={tmp_path / 'actor.yaml'}")
    assert "unit: m" in sentence
    assert not (tmp_path / "actor.yaml").exists()


@pytest.mark.parametrize(
    ("distance", "subject", "plausible"),
    [(3.0, 1.7, True), (0.2, 1.7, False), (60.0, 1.7, False), (0.2, 0.1, True), (60.0, 5.0, True), (3.0, 0.1, True)],
)
def test_the_body_says_from_where_it_is_filmed(distance, subject, plausible):
    geometry = rig_geometry(ring_rig(4, distance=distance), "z")
    geometry = replace(geometry, centres=geometry.target + distance * _unit(geometry.centres - geometry.target))
    assert (implausible_distance(geometry, None, subject) is None) == plausible


def _unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def test_cameras_that_look_the_same_way_are_at_no_distance_from_anything():
    rig = ring_rig(1).select(["cam0", "cam0"])
    assert implausible_distance(rig_geometry(rig, "z"), None, 1.7) is None


@pytest.mark.parametrize(("distance", "severity"), [(3.0, "ok"), (3000.0, "error"), (0.003, "error")])
def test_a_unit_that_is_far_off_is_an_error(distance, severity):
    rig = unit_rig(ring_rig(4), 1.0 / (distance / 3.0))
    (finding,) = scale_findings(None, rig_geometry(rig, "z"), None)
    assert finding.severity == severity


def test_a_rig_in_other_units_keeps_its_fisheye_lenses():
    rig = ring_rig(2)
    fisheye = CameraRig(rig.names, replace(rig.cameras, fisheye=jnp.array([True, False])))
    assert unit_rig(fisheye, 2.0).is_fisheye("cam0")


def test_points_where_a_lens_model_folds_back_are_in_no_picture():
    rig = ring_rig(1, distortion=(-0.4, 0.0, 0.0, 0.0, 0.0))
    (bound,) = unfolded_radii(rig)
    assert bound == pytest.approx(np.sqrt(1.0 / 1.2))
    pose = np.linalg.inv(np.asarray(rig.cameras.camera_from_world, float)[0])
    rays = np.array([[0.9 * bound, 0.0, 1.0], [1.1 * bound, 0.0, 1.0]])
    points = rays @ pose[:3, :3].T + pose[:3, 3]
    pixels, _ = picture_points(rig, points[None])
    assert np.isnan(pixels[0, 0]).any(axis=-1).tolist() == [False, True]
    np.testing.assert_allclose(pixels[0, 0, 0], opencv_pixels(rig, "cam0", points[0]), atol=0.05)


def test_a_lens_model_without_a_fold_bends_nothing_back():
    assert np.isinf(unfolded_radii(ring_rig(1, distortion=(0.1, 0.01, 0.0, 0.0, 0.0)))).all()


@pytest.mark.parametrize("command", SCHEMAS)
def test_every_command_accepts_overwrite(command):
    required = {"recording": "r", "out": "o.rrd", "motion": "m", "truth": "t", "to": "x.bvh", "from_": "f"}
    schema = SCHEMAS[command].__dataclass_fields__
    words = [f"{key.removesuffix('_')}={value}" for key, value in required.items() if key in schema]
    assert composed(command, [*words, "overwrite=true"]).overwrite


def test_a_mouse_is_no_person_with_a_wrong_unit():
    """Four cameras 0.3 m away, a tenth of the usual set-up, as for small animals."""
    near = rig_geometry(unit_rig(ring_rig(4), 10.0), "z")
    (unsaid,) = scale_findings(None, near, None)
    assert unsaid.severity == "warning"
    assert "body=FILE" in unsaid.remedy
    (said,) = scale_findings(None, near, None, subject=0.1)
    assert said.severity == "ok"
    (tall,) = scale_findings(SubjectSize(0.06, 0.0), near, None, subject=0.08)
    assert tall.severity == "ok"
    (small,) = scale_findings(SubjectSize(0.06, 0.0), near, None)
    assert small.severity == "warning"
    (wrong,) = scale_findings(SubjectSize(1700.0, 0.0), near, None)
    assert wrong.severity == "error"
    assert "unit: mm" in wrong.remedy


def test_pixels_without_a_direction_do_not_disturb_what_moves():
    """A lens model that gives no angle towards the corners; warnings are errors in tests."""
    rig = ring_rig(3, distortion=(-0.9, 0.4, 0.0, 0.0, 0.0))
    rng = np.random.default_rng(0)
    grey = tuple(rng.integers(0, 255, (8, 40, 60), dtype=np.uint8) for _ in rig.names)
    clip = Clip(recording_of(rig, 8), 0, grey, np.ones((3, 8), bool), {}, {})
    codes = pair_barcodes(motion_of(clip, rig))
    assert all(np.isfinite(part).all() for both in codes.values() for part in both)


def fits(*away):
    return {camera: Misfit(0.95, degrees, 0.0) for camera, degrees in enumerate(away)}


@pytest.mark.parametrize(
    ("away", "told"),
    [
        ((0.0, 0.6, 0.0, 0.3, 0.0, 0.0), True),
        ((0.0, 0.45, 0.0, 0.0), True),
        ((0.0, 0.3, 0.0, 0.0), False),
        ((0.0, 0.6, 0.5, 0.0, 0.0), False),
        ((0.3, 0.6, 0.3, 0.3), False),
        ((0.0, 0.6, 0.0), False),
    ],
)
def test_a_camera_that_is_slightly_turned_is_told_where_all_others_agree(away, told):
    found = _slightly_turned(ring_rig(len(away)), fits(*away), "videos")
    assert [finding.cameras for finding in found] == ([("cam1",)] if told else [])


def test_a_turn_of_seven_tenths_of_a_degree_is_seen_in_silhouettes():
    body, rig = in_colors(shipped("human")), ring_rig(5, (640, 480), distance=3.5)
    pose = standing(body, 1.0)
    masks = dict(enumerate(draw(body, pose, rig, masks=True)))
    turned = np.array(rig.cameras.camera_from_world, float)
    about_up = cv2.Rodrigues(np.array([0.0, np.deg2rad(0.7), 0.0]))[0]
    turned[2, :3] = about_up @ turned[2, :3]
    poses = jnp.asarray(turned, rig.cameras.camera_from_world.dtype)
    moved = CameraRig(rig.names, replace(rig.cameras, camera_from_world=poses))
    moment = Moment({}, masks)
    findings = lambda cameras: calibration_findings(unit_rig(cameras, 3.5), [moment], [])[0]
    assert [finding.severity for finding in findings(rig)] == ["ok"]
    (found,) = findings(moved)
    assert found.cameras == ("cam2",)
    assert "0.5 degrees" in found.what or "0.6 degrees" in found.what or "0.7 degrees" in found.what
