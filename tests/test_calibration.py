"""Calibration files: what they mean, and one sentence for everything that is wrong with them."""

import cv2
import jax.numpy as jnp
import numpy as np
import pytest
from small_recording import toml_camera, write_calibration

from sogjax.errors import InputError
from sogjax.io.calibration.load import find_calibrations, load_calibration
from sogjax.io.calibration.rig import CameraEntry, rig_from_entries
from sogjax.io.calibration.tables import write_toml
from sogjax.model.camera import distort, project_points


def test_a_toml_camera_projects_as_opencv_does_with_the_files_numbers(tmp_path):
    path = write_calibration(
        tmp_path, toml_camera("a"), toml_camera("b", distortions="[-0.1, 0.05, 0.001, -0.002, 0.01]")
    )
    rig = load_calibration(path)
    assert rig.names == ("a", "b")
    assert rig.image_size("b") == (64, 48)
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (20, 3))
    matrix = np.array([[60.0, 0.0, 31.5], [0.0, 60.0, 23.5], [0.0, 0.0, 1.0]])
    for name, distortion in {"a": np.zeros(5), "b": np.array([-0.1, 0.05, 0.001, -0.002, 0.01])}.items():
        rotation, translation = np.array([1.2, -0.5, 0.3]), np.array([0.1, 0.2, 3.0])
        expected, _ = cv2.projectPoints(points, rotation, translation, matrix, distortion)
        camera = rig.camera(name)
        pixels, _ = project_points(camera, jnp.asarray(points))
        np.testing.assert_allclose(distort(camera, pixels), expected.reshape(-1, 2), atol=1e-4)


def test_millimetres_move_cameras_a_thousandth_as_far(tmp_path):
    path = write_calibration(tmp_path, toml_camera("a", translation="[100.0, 200.0, 3000.0]"))
    pose = np.asarray(load_calibration(path, "mm").cameras.camera_from_world)
    np.testing.assert_allclose(pose[0, :3, 3], [0.1, 0.2, 3.0], rtol=1e-6)
    with pytest.raises(InputError, match="'inch'"):
        load_calibration(path, "inch")


def test_what_is_written_is_read_again(tmp_path):
    tables = [toml_camera("a"), toml_camera("b", name='"the \\"b\\" camera"', rotation="[0.0, 3.1, 0.0]")]
    rig = load_calibration(write_calibration(tmp_path, *tables))
    write_toml(tmp_path / "again.toml", rig)
    again = load_calibration(tmp_path / "again.toml")
    assert again.names == rig.names == ("a", 'the "b" camera')
    for name in ("intrinsics", "camera_from_world", "distortion", "image_size"):
        np.testing.assert_allclose(getattr(again.cameras, name), getattr(rig.cameras, name), atol=1e-6)


def test_cameras_are_selected_by_name_in_the_order_asked_for(tmp_path):
    tables = [toml_camera(f"cam{k}", translation=f"[{k}.0, 0.0, 3.0]") for k in (2, 10, 1)]
    rig = load_calibration(write_calibration(tmp_path, *tables)).select(["cam1", "cam10"])
    assert rig.names == ("cam1", "cam10")
    np.testing.assert_allclose(rig.cameras.camera_from_world[:, 0, 3], [1.0, 10.0])
    np.testing.assert_allclose(rig.camera("cam10").camera_from_world[0, 3], 10.0)


def test_metadata_is_ignored_and_the_tables_key_names_a_camera_without_name(tmp_path):
    path = write_calibration(tmp_path, toml_camera("a", name=None), "[metadata]\nerror = 0.3\nadjusted = false\n")
    assert load_calibration(path).names == ("a",)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rotation": "[nan, 0.0, 0.0]"}, "nan"),
        ({"rotation": "[0.0, inf, 0.0]"}, "inf"),
        ({"rotation": "[1.0, 2.0]"}, r"\[1.0, 2.0\]"),
        ({"rotation": "[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]"}, "3 numbers"),
        ({"rotation": '"none"'}, "none"),
        ({"rotation": None}, "'rotation'"),
        ({"translation": "[0.0, nan, 0.0]"}, "translation.*nan"),
        ({"translation": "[0.0]"}, r"\[0.0\]"),
        ({"matrix": "[[nan, 0, 1], [0, 60, 1], [0, 0, 1]]"}, "nan"),
        ({"matrix": "[[60, 0, 1], [0, 60, 1]]"}, "3 x 3"),
        ({"matrix": "[[60, 0], [0, 60, 1], [0, 0, 1]]"}, "3 x 3"),
        ({"matrix": "[[60, 5, 1], [0, 60, 1], [0, 0, 1]]"}, "skew"),
        ({"matrix": "[[-60, 0, 1], [0, 60, 1], [0, 0, 1]]"}, "-60"),
        ({"matrix": "[[60, 0, 1], [0, 60, 1], [0, 0, 2]]"}, "fx, 0, cx"),
        ({"distortions": "[0.0, 0.0, 0.0]"}, "3 distortion"),
        ({"distortions": "[0, 0, 0, 0, 0, 0, 0, 0]"}, "8 distortion"),
        ({"distortions": "[0.0, nan, 0.0, 0.0]"}, "nan"),
        ({"size": "[64]"}, r"\[64\]"),
        ({"size": "[64.5, 48]"}, "64.5"),
        ({"size": "[0, 48]"}, r"\[0, 48\]"),
        ({"size": "[nan, 48]"}, "nan"),
        ({"fisheye": '"yes"'}, "fisheye = 'yes'"),
        ({"fisheye": "true", "distortions": "[0, 0, 0, 0, 0]"}, "5 distortion coefficients.*fisheye"),
        ({"name": "7"}, "7 of"),
        ({"name": '""'}, "''"),
    ],
)
def test_a_wrong_value_is_named_with_its_file_and_camera(tmp_path, changes, message):
    path = write_calibration(tmp_path, toml_camera("good"), toml_camera("bad", **changes))
    with pytest.raises(InputError, match=message) as error:
        load_calibration(path)
    assert str(path) in str(error.value)
    assert "bad" in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not a calibration of a known format"),
        (b"just text", "not a calibration of a known format"),
        (b"\0\1\2" * 100, "not a calibration of a known format"),
        (b"[a]\nmatrix = [[1, 2", "TOML"),
        (b"[a]\nmatrix = " + b"[" * 100000, "TOML"),
        (b"[a]\n# \xff\xfe\nmatrix = 1\n", "TOML"),
        (b"[metadata]\nmatrix = 3\n", "no camera"),
    ],
)
def test_a_file_that_is_no_calibration(tmp_path, content, message):
    path = tmp_path / "calibration.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as error:
        load_calibration(path)
    assert str(path) in str(error.value)


def test_names_are_unique_and_the_file_is_there(tmp_path):
    path = write_calibration(tmp_path, toml_camera("a"), toml_camera("b", name='"a"'))
    with pytest.raises(InputError, match="'a' occurs twice"):
        load_calibration(path)
    with pytest.raises(InputError, match=r"absent\.toml"):
        load_calibration(tmp_path / "absent.toml")


@pytest.mark.parametrize(
    ("rotation", "message"),
    [
        (np.eye(3) * 1.1, "not a rotation"),
        (np.diag([1.0, 1.0, -1.0]), "determinant -1"),
        (np.zeros((3, 3)), "not a rot"),
    ],
)
def test_a_matrix_that_is_no_rotation_is_refused_for_formats_that_give_matrices(tmp_path, rotation, message):
    entry = CameraEntry("a", np.diag([60.0, 60.0, 1.0]), rotation, np.zeros(3), np.zeros(4), (64, 48))
    with pytest.raises(InputError, match=message):
        rig_from_entries(tmp_path / "calibration.json", [entry])


def test_a_calibration_is_found_by_content_whatever_its_name(tmp_path):
    write_calibration(tmp_path, toml_camera("a")).rename(tmp_path / "Calib_board.toml")
    (tmp_path / "notes.toml").write_text("[subject]\nname = 'x'\n")
    (tmp_path / "recording.yaml").write_text("up: z\n")
    (tmp_path / "readme.txt").write_text("matrix = tidy\n")
    assert [path.name for path in find_calibrations(tmp_path)] == ["Calib_board.toml"]
