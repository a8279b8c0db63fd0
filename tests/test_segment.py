"""`sogjax segment`: what it writes, and that nothing that was given is touched."""

import weakref

import cv2
import numpy as np
import pytest
from command_line import done, refused
from rig_cases import ring_rig
from small_recording import frame_of, make_recording, write_image

from sogjax.actor.example_masks import FROM_CLIP, ExampleMasks
from sogjax.cli import segment
from sogjax.io.image_file import read_mask
from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings
from sogjax.view.tiles import GREEN, TITLE_HEIGHT, Tile, contact_sheet


def iou(a, b):
    return (a & b).sum() / (a | b).sum()


@pytest.mark.slow
def test_masks_and_sheets_of_a_rendered_person(capsys, tmp_path):
    """One camera keeps its mask, one has neither mask nor plate, the others' masks are made from plates."""
    recording = tmp_path / "person"
    render_recording(SynthSettings(cameras=4, frames=1, width=320, height=240, seed=2), recording)
    poses = sorted(path.name for path in (recording / "example_poses").iterdir())
    truth = {}
    for pose in poses:
        for camera in ("cam01", "cam02", "cam03"):
            path = recording / "example_poses" / pose / f"{camera}.mask.png"
            truth[pose, camera] = read_mask(path)
            path.unlink()
    (recording / "background" / "cam03.jpg").unlink()
    before = {path: path.read_bytes() for path in recording.rglob("*") if path.is_file()}

    out, err = done(capsys, "segment", f"recording={recording}", f"out={tmp_path / 'masks'}")
    assert out.split() == [str(tmp_path / "masks" / f"{pose}.png") for pose in out_order(out)]
    assert sorted(out_order(out)) == poses
    assert err.count("warning") == err.count("background/ has no picture of cam03") == 1
    for pose in poses:
        written = sorted(path.name for path in (tmp_path / "masks" / pose).iterdir())
        assert written == ["cam00.mask.png", "cam01.mask.png", "cam02.mask.png"]
        for camera in ("cam01", "cam02"):
            made = read_mask(tmp_path / "masks" / pose / f"{camera}.mask.png")
            assert made.shape == truth[pose, camera].shape
            assert iou(made, truth[pose, camera]) > 0.8
        given = read_mask(recording / "example_poses" / pose / "cam00.mask.png")
        np.testing.assert_array_equal(read_mask(tmp_path / "masks" / pose / "cam00.mask.png"), given)
        assert cv2.imread(str(tmp_path / "masks" / f"{pose}.png")).shape[1] > 320
    assert {path: path.read_bytes() for path in recording.rglob("*") if path.is_file()} == before

    inside = recording / "example_poses"
    assert str(inside) in refused(capsys, "segment", f"recording={recording}", f"out={inside}")


def out_order(out):
    return [line.rsplit("/", 1)[-1].removesuffix(".png") for line in out.split()]


def test_pictures_of_one_example_pose_at_a_time_are_in_memory(capsys, tmp_path, monkeypatch):
    recording = make_recording(tmp_path / "recording", settings="up: z\nexample_poses: [3, 0, 1]\n")
    before, frames = [], []

    def found(recording, example, images, *_):
        assert not any(picture() is not None for picture in before)
        before.extend(map(weakref.ref, images.values()))
        frames.append([frame_of(image) for image in images.values()])
        masks = {camera: image[..., 0] > 0 for camera, image in images.items()}
        return ExampleMasks(masks, dict.fromkeys(masks, FROM_CLIP), {}, {}, False, ())

    monkeypatch.setattr(segment, "with_examples", lambda *_: (None, None, None))
    monkeypatch.setattr(segment, "example_masks", found)
    out, _ = done(capsys, "segment", f"recording={recording}", f"out={tmp_path / 'masks'}")
    assert out_order(out) == ["frame_3", "frame_0", "frame_1"]
    assert frames == [[3, 3], [0, 0], [1, 1]]


def test_a_sheet_shows_every_picture_with_its_mask_tinted():
    names = ring_rig(3).names
    image = np.full((90, 120, 3), 100, np.uint8)
    mask = np.zeros((90, 120), bool)
    mask[30:80, 40:90] = True
    sheet = contact_sheet([Tile(image, [(mask, GREEN)], name) for name in names], "three")
    assert sheet.shape[0] > TITLE_HEIGHT
    tiles = sheet[TITLE_HEIGHT:].reshape(2, 90, 2, 120, 3).swapaxes(1, 2).reshape(4, 90, 120, 3)
    for tile in tiles[:3]:
        np.testing.assert_allclose(tile[55, 65], 0.55 * 100 + 0.45 * np.array(GREEN), atol=1)
        np.testing.assert_array_equal(tile[85, 5], 100)
    assert not tiles[3].any()


@pytest.mark.slow
def test_a_sheet_shows_what_was_painted_to_stand_in_front(capsys, tmp_path):
    recording = make_recording(tmp_path / "recording")
    mask = np.zeros((48, 64), np.uint8)
    mask[24:] = 255
    write_image(recording / "occluders" / "left.png", mask)
    for camera in ("left", "right"):
        write_image(recording / "background" / f"{camera}.jpg", np.full((48, 64, 3), 90, np.uint8))
    out, _ = done(capsys, "segment", f"recording={recording}", f"out={tmp_path / 'seen'}", "frames=[0]")
    path = tmp_path / "seen" / "occluders.png"
    assert str(path) in out.split()
    sheet = cv2.imread(str(path)).astype(int)
    blue = (sheet[..., 0] - sheet[..., 2] > 40).mean()
    assert 0.05 < blue < 0.4  # a half of one of two pictures, below a title
    assert "overwrite" in refused(capsys, "segment", f"recording={recording}", f"out={tmp_path / 'seen'}", "frames=[0]")
