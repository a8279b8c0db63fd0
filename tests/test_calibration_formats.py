"""Every calibration format projects as OpenCV does with the numbers in the file; what is wrong is one sentence."""

import shutil
import time

import calibration_cases as cases
import cv2
import jax.numpy as jnp
import numpy as np
import pytest
from command_line import done, refused
from damaged import FUZZ, damaged
from hypothesis import given
from slow_values import fast_and_slow
from small_recording import make_recording

from sogjax.errors import InputError
from sogjax.io.calibration.load import find_calibrations, load_calibration, save_calibration
from sogjax.io.calibration.skeletool import write_skeletool
from sogjax.io.calibration.tables import write_toml
from sogjax.io.recording import open_recording
from sogjax.model.camera import distort, project_points

KINDS = (*cases.TEXTS, "EasyMocap")
POINTS = np.random.default_rng(0).uniform(-0.5, 0.5, (30, 3))
PIXELS = 5e-3


def assert_projects(rig, distortion=cases.DISTORTION, fisheye=False):
    """Both cameras project as OpenCV does."""
    assert rig.names == tuple(cases.TURNS)
    for name in rig.names:
        turn, move = cases.TURNS[name], cases.MOVES[name]
        if fisheye:
            expected, _ = cv2.fisheye.projectPoints(POINTS[:, None], turn, move, cases.MATRIX, distortion)
        else:
            expected, _ = cv2.projectPoints(POINTS, turn, move, cases.MATRIX, distortion)
        pixels, _ = project_points(rig.camera(name), jnp.asarray(POINTS))
        np.testing.assert_allclose(distort(rig.camera(name), pixels), expected.reshape(-1, 2), atol=PIXELS)


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_projects_as_opencv_does_with_its_numbers(tmp_path, kind):
    rig = load_calibration(cases.write(tmp_path, kind))
    assert_projects(rig, cases.RADIAL if kind == "Skeletool" else cases.DISTORTION)
    assert [rig.image_size(name) for name in rig.names] == [cases.SIZE, cases.SIZE]


@pytest.mark.parametrize("kind", KINDS)
def test_the_unit_may_be_another_than_the_formats(tmp_path, kind):
    usual = {"TOML": 1.0, "EasyMocap": 1.0, "Panoptic": 0.01}.get(kind, 0.001)
    path = cases.write(tmp_path, kind)
    as_written = np.asarray(load_calibration(path).cameras.camera_from_world)[:, :3, 3]
    as_metres = np.asarray(load_calibration(path, "m").cameras.camera_from_world)[:, :3, 3]
    np.testing.assert_allclose(as_metres * usual, as_written, rtol=1e-5)


@pytest.mark.parametrize("ending", ["toml", "calibration"])
@pytest.mark.parametrize("kind", KINDS)
def test_round_trip(tmp_path, kind, ending):
    rig = load_calibration(cases.write(tmp_path, kind))
    radial = kind == "Skeletool"
    if ending == "calibration" and not radial:
        with pytest.raises(InputError, match=r"again\.calibration.*'left'.*k1 k2 p1 p2 k3.*\.toml"):
            save_calibration(tmp_path / "again.calibration", rig)
        assert not (tmp_path / "again.calibration").exists()
        return
    save_calibration(tmp_path / f"again.{ending}", rig)
    again = load_calibration(tmp_path / f"again.{ending}")
    assert_projects(again, cases.RADIAL if radial else cases.DISTORTION)
    for name in ("intrinsics", "camera_from_world", "distortion", "image_size"):
        np.testing.assert_allclose(getattr(again.cameras, name), getattr(rig.cameras, name), rtol=1e-6, atol=1e-6)


def test_fisheye_cameras(tmp_path):
    coefficients = np.array([0.05, -0.02, 0.004, -0.001])
    text = cases.toml_text().replace(str(cases.listed(cases.DISTORTION)), str(coefficients.tolist()))
    (tmp_path / "a.toml").write_text(text.replace("[left]", "[left]\nfisheye = true").replace(
        "[right]", "[right]\nfisheye = true"))  # fmt: skip
    rig = load_calibration(tmp_path / "a.toml")
    assert_projects(rig, coefficients, fisheye=True)
    write_toml(tmp_path / "b.toml", rig.select(["right", "left"]))
    assert_projects(load_calibration(tmp_path / "b.toml").select(["left", "right"]), coefficients, fisheye=True)
    with pytest.raises(InputError, match="fisheye lens"):
        write_skeletool(tmp_path / "c.calibration", rig)
    (tmp_path / "mixed.toml").write_text(text.replace("[left]", "[left]\nfisheye = true"))
    mixed = load_calibration(tmp_path / "mixed.toml")
    assert (mixed.is_fisheye("left"), mixed.is_fisheye("right")) == (True, False)
    assert load_calibration(cases.write(tmp_path, "TOML")).cameras.fisheye is None
    (tmp_path / "five.toml").write_text(cases.toml_text().replace("[left]", "[left]\nfisheye = true"))
    with pytest.raises(InputError, match=r"'left'.*5 distortion coefficients.*k1 k2 k3 k4"):
        load_calibration(tmp_path / "five.toml")


@pytest.mark.parametrize("given_one", ["intri.yml", "extri.yml"])
def test_either_file_of_a_pair_finds_the_other(tmp_path, given_one):
    cases.write(tmp_path, "EasyMocap")
    (tmp_path / "other.yml").write_text("%YAML:1.0\n---\nnames: [a]\n")
    assert_projects(load_calibration(tmp_path / given_one))
    found = find_calibrations(tmp_path)
    assert [path.name for path in found] == ["extri.yml"]
    (tmp_path / "intri.yml").rename(tmp_path / "lenses.yaml")
    (tmp_path / "extri.yml").rename(tmp_path / "places.yml")
    assert len(find_calibrations(tmp_path)) == 1
    assert_projects(load_calibration(tmp_path / "lenses.yaml"))
    (tmp_path / "places.yml").unlink()
    with pytest.raises(InputError, match=r"lenses\.yaml: is half.*extri\.yml"):
        load_calibration(tmp_path / "lenses.yaml")


def test_both_halves_in_one_file(tmp_path):
    both = cases.intri_text() + cases.extri_text().split("---\n")[1].replace("names:", "more:")
    (tmp_path / "calibration.yml").write_text(both)
    assert_projects(load_calibration(tmp_path / "calibration.yml"))


def test_sizes_that_the_calibration_does_not_say_are_those_of_the_videos(tmp_path):
    folder = make_recording(tmp_path / "walk", settings="up: z\nunit: m\n")
    (folder / "calibration.toml").unlink()
    (folder / "intri.yml").write_text(cases.intri_text(sizes=False))
    (folder / "extri.yml").write_text(cases.extri_text())
    rig = open_recording(folder).rig
    assert [rig.image_size(name) for name in rig.names] == [(64, 48), (64, 48)]
    with pytest.raises(InputError, match=r"'left'.*how large"):
        load_calibration(folder / "intri.yml").image_size("left")


def test_the_command(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cases.write(tmp_path, "EasyMocap")
    done(capsys, "export", "calibration=intri.yml", "to=rig.toml")
    assert_projects(load_calibration(tmp_path / "rig.toml"))
    cases.write(tmp_path, "Skeletool", "their cameras.calibration")
    done(capsys, "export", "calibration=their cameras.calibration", "to=ours.toml")
    done(capsys, "export", "calibration=ours.toml", "to=ours.calibration")
    assert_projects(load_calibration(tmp_path / "ours.calibration"), cases.RADIAL)
    (tmp_path / "intri.yml").write_text(cases.intri_text(sizes=False))
    assert "how large" in refused(capsys, "export", "calibration=intri.yml", "to=no.toml")
    assert ".toml" in refused(capsys, "export", "calibration=rig.toml", "to=no.yml")
    assert "motion=" in refused(capsys, "export", "to=no.toml")
    assert "one of them" in refused(capsys, "export", "calibration=rig.toml", "motion=a.npz", "to=no.toml")
    assert not list(tmp_path.glob("no.*"))
    recording = make_recording(tmp_path / "walk")
    done(capsys, "export", f"calibration={recording}", "to=walk.toml")
    assert load_calibration(tmp_path / "walk.toml").names == ("left", "right")


WRONG = [
    ("Skeletool", "sensor 10 10", "sensible 10", r"line 3 begins with 'sensible'"),
    ("Skeletool", "size 1920 1080", "size 1920", "size = '1920' is not 2 numbers"),
    ("Skeletool", "size 1920 1080", "size 1920 1080.5", r"1080\.5"),
    ("Skeletool", "size 1920 1080", "size 1920 1000000000", "1000000000"),
    ("Skeletool", "size 1920 1080", "", "'left'.*no 'size'"),
    ("Skeletool", "name          left", "name", "no name"),
    ("Skeletool", "intrinsic   1685.5 0.0", "intrinsic   1685.5 3.0", "'left'.*skew"),
    ("Skeletool", "intrinsic   1685.5 0.0", "intrinsic   1685.5 much", "16 numbers"),
    ("Skeletool", "frame 2\r\nextrinsic   ", "frame 2\r\nextrinsic   1", "extrinsic of frame 2 is not that of frame 0"),
    ("Skeletool", "name          right", "name          left", "'left' occurs twice"),
    ("Skeletool", " 0.0 0.0 0.0 1.0 \r\n", " 0.0 0.0 0.5 1.0 \r\n", "last row"),
    ("Qualisys", "<calibration>", "<!DOCTYPE a [<!ENTITY b 'c'>]><calibration>", "<!DOCTYPE"),
    ("Qualisys", "<calibration>", "<calibration><!ENTITY b 'c'>", "<!ENTITY"),
    ("Qualisys", 'serial="left"', "", "serial"),
    ("Qualisys", 'r11="', 'r11="a', "r11.*not a number"),
    ("Qualisys", 'r11="', 'r00="', "r11 = ''"),
    ("Qualisys", 'skew="0.0"', 'skew="0.5"', "skew"),
    ("Qualisys", 'right="2019"', 'right="2019.5"', "not a whole number"),
    ("Qualisys", "</camera>", "", "XML"),
    ("Qualisys", "transform", "transformed", "no <transform>"),
    ("Panoptic", '"name": "left"', '"name": 7', r"cameras\[0\] has no name"),
    ("Panoptic", '"K"', '"L"', "no 'K'"),
    ("Panoptic", '"resolution"', '"resolution": 5, "type"', r"resolution = 5"),
    ("Panoptic", "1685.5", '"wide"', "K ="),
    ("Panoptic", "1685.5", "NaN", "not finite"),
    ("Panoptic", "1685.5", "1" + "0" * 400, "K ="),
    ("Panoptic", '"cameras": [', '"cameras": [7, ', "list `cameras`"),
    ("Panoptic", "}", "", "JSON"),
]


@pytest.mark.parametrize(("kind", "old", "new", "message"), WRONG)
def test_what_is_wrong_is_named(tmp_path, kind, old, new, message):
    text = cases.TEXTS[kind]()
    assert old in text
    path = tmp_path / "calibration.any"
    path.write_bytes(text.replace(old, new, 1).encode())
    with pytest.raises(InputError, match=message) as error:
        load_calibration(path)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("half", "old", "new", "message"),
    [
        ("intri", "K_right", "L_right", "'right'.*T_right.*no K_right"),
        ("intri", "W_left: 1920", "W_left: wide", "W_left"),
        ("intri", "W_left: 1920", "W_left: .Nan", "W_left"),
        ("intri", "rows: 3", "rows: 1000000000", "K_left"),
        ("intri", "1685.5", "'a'", "K_left"),
        ("intri", "names:", "\tnames: [", "OpenCV's YAML"),
        ("intri", "names:", "names: " + "[" * 100 + "]" * 100 + "\nagain:", "nested"),
        ("extri", "R_left", "Q_left", "'left'.*no R_left"),
        ("extri", "T_left", "S_left", "'left'.*no T_left"),
        ("extri", "rows: 3", "rows: -3", "R_left"),
    ],
)
def test_what_is_wrong_in_a_pair_is_named(tmp_path, half, old, new, message):
    cases.write(tmp_path, "EasyMocap")
    path = tmp_path / f"{half}.yml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=message) as error:
        load_calibration(tmp_path / "intri.yml")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "content",
    [
        b"<camera focalLengthU>" + b"<a>" * 1_000_000,
        b'{"cameras": ' + b"[" * 1_000_000,
        b"Skeletool Camera Calibration File V1.0\n" + b"frame 1\n" * 100_000,
        b"%YAML:1.0\n---\nK_a: " + b"[" * 1_000_000,
        b"%YAML:1.0\n---\nK_a:\n" + b"- " * 1_000_000,
        b"\n" * 1_000_000,
    ],
)
def test_large_nonsense_is_refused_at_once(tmp_path, content):
    path = tmp_path / "calibration.any"
    path.write_bytes(content)
    begin = time.perf_counter()
    with pytest.raises(InputError):
        load_calibration(path)
    assert time.perf_counter() - begin < 10.0


@pytest.mark.parametrize("first", ["[1]", "{a: 1}", "  a: 1", '  - "a"', "- 1", "a: 1\n---\n  - 1", "a: 1\n..."])
def test_what_opencv_would_read_for_ever_is_refused(tmp_path, first):
    path = tmp_path / "intri.yml"
    path.write_text(f"%YAML:1.0\n---\n{first}\nK_a:\n  - 1\n")
    with pytest.raises(InputError, match="not one map of keys"):
        load_calibration(path)


def only_input_errors(path, text):
    path.write_bytes(text.encode("utf-8", errors="surrogatepass"))
    try:
        rig = load_calibration(path)
    except InputError as error:
        message = str(error)
    else:
        message, finite = "", np.isfinite(np.asarray(rig.cameras.intrinsics)).all()
        assert finite
    assert "\n" not in message


@pytest.mark.parametrize("kind", fast_and_slow(*cases.TEXTS))
def test_a_damaged_file_is_read_or_refused(tmp_path, kind):
    @FUZZ
    @given(damaged(cases.TEXTS[kind]()))
    def fuzz(text):
        only_input_errors(tmp_path / "calibration.any", text)

    fuzz()


@pytest.mark.parametrize("half", ["intri", "extri"])
def test_a_damaged_half_is_read_or_refused(tmp_path, half):
    cases.write(tmp_path, "EasyMocap")

    @FUZZ
    @given(damaged((tmp_path / f"{half}.yml").read_text()))
    def fuzz(text):
        shutil.copy(tmp_path / "intri.yml", tmp_path / "whole.txt")
        only_input_errors(tmp_path / f"{half}.yml", text)

    fuzz()
