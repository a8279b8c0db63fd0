"""Pictures of the empty scene held against the videos: moved, matched in tone, or found unfit."""

import re
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest

from sogjax.errors import InputError
from sogjax.io.recording import open_recording
from sogjax.io.video import read_still
from sogjax.run import background, plates
from sogjax.run.background import learn_background
from sogjax.run.clip import Clip
from sogjax.run.plates import median_picture, scene_samples, with_example_plates
from sogjax.scene.background import BackgroundImage
from sogjax.scene.plates import FittedPlate, fitted_plate
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

SIZE = (432, 324)


def room(seed=0, size=SIZE):
    """A room with patterns of all sizes, BGR."""
    rng = np.random.default_rng(seed)
    layers = [cv2.resize(rng.uniform(0, 255, (n, n, 3)), size, interpolation=cv2.INTER_CUBIC) for n in (6, 20, 70)]
    return np.clip(np.mean(layers, axis=0) + rng.normal(0, 2.0, (size[1], size[0], 3)), 0, 255).astype(np.uint8)


def moved(picture, right, down):
    """The picture of a camera that was turned by so many pixels."""
    move = np.array([[1.0, 0.0, right], [0.0, 1.0, down]])
    return cv2.warpAffine(picture, move, picture.shape[1::-1], borderMode=cv2.BORDER_REFLECT)


def somebody(picture, left=180, top=90):
    """The picture with somebody standing in it."""
    out = picture.copy()
    cv2.ellipse(out, (left, top + 90), (28, 95), 0, 0, 360, (20, 30, 190), -1)
    return out


def scene_with_subject():
    return somebody(room(), left=330)


def test_a_picture_that_agrees_stays_as_it_is():
    plate = room()
    for scene in (plate, scene_with_subject(), np.clip(plate * 0.95 + 3, 0, 255).astype(np.uint8)):
        found = fitted_plate(plate, scene)
        assert found.picture is plate
        assert found.known.all()
        assert found.fits
        assert found.said("cam1.jpg") is None


@pytest.mark.parametrize("shift", [(6.0, -5.0), (-12.0, 5.0), (13.0, 0.0)])
@pytest.mark.parametrize("light", [1.0, 0.7])
def test_a_shifted_picture_is_moved_to_its_place(shift, light):
    scene = scene_with_subject()
    plate = np.clip(light * moved(room(), *shift), 0, 255).astype(np.uint8)
    found = fitted_plate(plate, scene)
    np.testing.assert_allclose(found.shift, [-shift[0], -shift[1]], atol=0.3)
    assert found.tone == pytest.approx(1.0 / light, rel=0.05)
    inside = found.known & (np.arange(SIZE[0]) < 280)
    assert np.median(np.abs(found.picture.astype(int) - room())[inside]) < 6.0
    assert not found.known.all()
    said = str(found.said("cam1.jpg"))
    assert f"is {found.pixels:.1f} pixels beside" in said
    assert ("of the light" in said or "times the light" in said) == (light != 1.0)


def test_a_larger_picture_is_moved_by_its_own_pixels():
    plate = cv2.resize(moved(room(), 6.0, 0.0), (864, 648), interpolation=cv2.INTER_CUBIC)
    found = fitted_plate(plate, room())
    assert found.pixels == pytest.approx(12.0, abs=0.5)
    assert found.picture.shape == plate.shape


def test_where_somebody_stands_in_the_picture_it_says_nothing():
    found = fitted_plate(somebody(room()), scene_with_subject())
    assert 0.02 < found.other < 0.12
    assert "somebody or something" in str(found.said("cam1.jpg"))
    stands = (somebody(room()) != room()).any(axis=-1)
    assert found.known[stands].mean() < 0.02
    assert found.known[:, 290:].all()


def test_a_shadow_between_the_legs_of_a_chair_is_nobody_in_the_picture():
    plate = room()
    for column in (150, 200):
        plate[100:190, column : column + 6] = 25
    plate[94:100, 144:212] = 25
    scene = plate.copy()
    scene[100:185, 156:200] = 0.6 * scene[100:185, 156:200]
    assert fitted_plate(plate, scene).known.all()
    plate[100:185, 156:200] = (20, 30, 190)
    assert not fitted_plate(plate, scene).known[110:175, 160:196].any()


def test_the_picture_of_another_camera_does_not_fit():
    found = fitted_plate(room(1), scene_with_subject())
    assert not found.fits
    assert "does not show what the videos of this camera show" in str(found.said("cam1.jpg"))


def test_a_bare_wall_fits_without_any_pattern():
    wall = np.full((324, 432, 3), 90, np.uint8)
    assert fitted_plate(wall, somebody(wall)).fits


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    """Three cameras that see a person walk, and the empty scene."""
    settings = SynthSettings(cameras=3, frames=12, width=320, height=240, example_poses=False, shadows=False)
    path = tmp_path_factory.mktemp("rendered") / "walk"
    render_recording(settings, path, workers=1)
    return path


def faulty(folder, tmp_path, camera, picture):
    """The recording with another picture of a camera's empty scene."""
    recording = open_recording(folder)
    path = tmp_path / f"{camera}.png"
    assert cv2.imwrite(str(path), picture)
    return replace(recording, background={**recording.background, camera: path})


def clip_of(recording):
    return Clip(recording, recording.frames, 8)


def background_of(recording, choice="auto"):
    return learn_background(clip_of(recording), choice)


@pytest.mark.slow
def test_a_run_takes_plates_that_agree_as_they_are(walk, capsys):
    recording = open_recording(walk)
    found = background_of(recording)
    for name, camera in zip(recording.rig.names, found.required(), strict=True):
        np.testing.assert_array_equal(camera.picture, read_still(recording, name, recording.background[name]))
        assert camera.known.all()
    assert "warning" not in capsys.readouterr().err


def test_a_run_moves_a_shifted_plate_and_says_so(walk, tmp_path, capsys):
    recording = open_recording(walk)
    plates = {name: read_still(recording, name, path) for name, path in recording.background.items()}
    found = background_of(faulty(walk, tmp_path, "cam01", moved(plates["cam01"], 8.0, 0.0)))
    said = capsys.readouterr().err
    assert re.search(r"cam01\.png is (7\.[89]|8\.[01]) pixels beside the videos, and was moved", said)
    assert said.count("warning") == 1
    moved_back = found.required()[1]
    assert np.abs(moved_back.picture[:, :300].astype(int) - plates["cam01"][:, :300]).mean() < 3.0
    assert not moved_back.known[:, -6:].any()


def test_a_plate_of_another_place_is_not_used(walk, tmp_path, capsys):
    recording = open_recording(walk)
    other = read_still(recording, "cam00", recording.background["cam00"])
    wrong = faulty(walk, tmp_path, "cam02", other)
    found = background_of(wrong)
    said = capsys.readouterr().err
    assert "cam02.png does not show what the videos of this camera show" in said
    assert "the background of cam02" in said
    assert not np.array_equal(found.required()[2].picture, other)
    with pytest.raises(InputError, match=r"cam02\.png does not show"):
        background_of(wrong, "pictures")


def test_where_somebody_stands_in_a_plate_and_without_one_the_clip_tells(walk, tmp_path, monkeypatch, capsys):
    recording = open_recording(walk)
    empty = {name: read_still(recording, name, path) for name, path in recording.background.items()}
    crowded = empty["cam01"].copy()
    crowded[60:180, 10:50] = (20, 160, 60)
    wrong = faulty(walk, tmp_path, "cam01", crowded)
    wrong = replace(wrong, background={name: path for name, path in wrong.background.items() if name != "cam02"})
    learnt = [replace(BackgroundImage.from_photograph(plate[::2, ::2]), origin="clip") for plate in empty.values()]
    monkeypatch.setattr(background, "_of_clip", lambda *_: background.Background(tuple(learnt)))
    found = background_of(wrong).required()
    said = capsys.readouterr().err
    assert "cam01.png shows somebody or something" in said
    assert "background/ has no picture of cam02" in said
    assert "the background of cam02 is learnt from the clip" in said
    np.testing.assert_array_equal(found[0].picture, empty["cam00"])
    assert found[1].known.all()
    np.testing.assert_array_equal(found[1].picture, empty["cam01"][::2, ::2])
    assert found[2].origin == "clip"
    monkeypatch.setattr(background, "_of_clip", lambda *_: background.Background(None, "nobody moves"))
    few = {**wrong.background, "cam00": tmp_path / "cam01.png"}  # of another camera
    unknown = background_of(replace(wrong, background=few))
    assert not unknown.is_learnt
    assert not unknown.required()[2].known.any()
    assert "the background of cam00, cam02 stays unknown, since nobody moves" in capsys.readouterr().err
    asked = replace(wrong, background={**wrong.background, "cam02": recording.background["cam02"]})
    assert not background_of(asked, "pictures").required()[1].known[70:170, 15:45].any()


def test_what_a_smaller_picture_knows_fills_a_larger_one():
    large = replace(BackgroundImage.from_photograph(np.full((60, 80, 3), 90, np.uint8)), known=np.zeros((60, 80), bool))
    plate = FittedPlate.unseen(np.full((30, 40, 3), 150, np.uint8))
    plate.known[:, :20] = False
    found = plates._filled(large, [plate])
    assert found.picture.shape == large.picture.shape
    assert not found.known[:, :39].any()
    assert found.known[:, 42:].all()
    assert (found.picture[:, 42:] == 150).all()


@pytest.mark.parametrize(
    ("tracked", "first", "last"), [((0, 3), 0, 6), ((9, 12), 5, 11), ((5, 7), 2, 8), ((11, 4, -1), 5, 11)]
)
def test_plates_are_held_against_more_than_a_short_clip(walk, monkeypatch, tracked, first, last):
    monkeypatch.setattr(plates, "SCENE_SECONDS", 0.2)
    recording = open_recording(walk)
    frames = scene_samples(Clip(recording, range(*tracked), 8)).frames
    assert recording.fps == 30.0
    assert (frames[0], frames[-1]) == (first, last)


@pytest.mark.parametrize("count", [1, 2, 8, 9])
def test_the_median_of_pictures_is_numpys_rounded_down(count):
    frames = [*np.random.default_rng(count).integers(0, 256, (count, 5, 7, 3), np.uint8)]
    np.testing.assert_array_equal(median_picture(frames), np.median(frames, axis=0).astype(np.uint8))


def test_pictures_of_example_poses_show_the_empty_scene_outside_of_their_masks(walk, tmp_path):
    folder = tmp_path / "posed"
    shutil.copytree(walk, folder)
    plates = {path.stem: cv2.imread(str(path)) for path in sorted((folder / "background").iterdir())}
    shutil.rmtree(folder / "background")
    for name, plate in plates.items():
        mask = np.zeros(plate.shape[:2], np.uint8)
        mask[: plate.shape[0] // 2] = 255
        posed = folder / "example_poses" / "stand"
        posed.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(posed / f"{name}.jpg"), plate)
        cv2.imwrite(str(posed / f"{name}.mask.png"), mask)
    found, added = with_example_plates(clip_of(open_recording(folder)), None)
    assert 0.3 < added < 0.5
    for camera, name in zip(found, plates, strict=True):
        assert not camera.known[: len(camera.known) // 2].any()
        shown = cv2.resize(plates[name], camera.known.shape[::-1], interpolation=cv2.INTER_AREA)
        assert np.abs(camera.picture.astype(int) - shown)[camera.known].mean() < 3.0


def test_what_stands_only_in_the_clip_is_not_taken_from_pictures_of_example_poses(walk, tmp_path):
    """A table that was brought in after the example poses is not somebody."""
    folder = tmp_path / "posed"
    shutil.copytree(walk, folder)
    plates = {path.stem: cv2.imread(str(path)) for path in sorted((folder / "background").iterdir())}
    shutil.rmtree(folder / "background")
    posed = folder / "example_poses" / "stand"
    posed.mkdir(parents=True)
    for name, plate in plates.items():
        rows, columns = (slice(size // 2, 3 * size // 4) for size in plate.shape[:2])
        plate[rows, columns] = 255 - plate[rows, columns]
        mask = np.zeros(plate.shape[:2], np.uint8)
        mask[:10, :10] = 255
        cv2.imwrite(str(posed / f"{name}.jpg"), plate)
        cv2.imwrite(str(posed / f"{name}.mask.png"), mask)
    found, added = with_example_plates(clip_of(open_recording(folder)), None)
    assert 0.6 < added < 0.95
    for camera in found:
        rows, columns = (slice(size // 2 + 2, 3 * size // 4 - 2) for size in camera.known.shape)
        assert camera.known[rows, columns].mean() < 0.1
