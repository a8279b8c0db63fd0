"""Masks of example poses: files before plates, wrong ones left out, and what is missing is said."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import draw, in_colors, standing
from rig_cases import recording_of, ring_rig
from test_segmentation import FLESH, iou, photo, scene

from sogjax.actor.example_masks import FROM_FILE, FROM_PHOTOGRAPH, example_masks
from sogjax.actor.silhouettes import load_all_pictures, load_images, load_pictures
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.scene.background import BackgroundImage

RIG = ring_rig(4, (160, 120), distance=1.6)
BODY = in_colors(shipped("dog"))
POSE = standing(BODY, 1.15)
TRUTH = draw(BODY, POSE, RIG, masks=True, disc=FLESH)
DRAWN = draw(BODY, POSE, RIG, disc=FLESH)


def write(path, image):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), image)
    return path


def example_recording(folder, pictures=(0, 1, 2, 3), masks=(), plates=()):
    """A dog before a patterned wall, with masks and plates of some of the cameras."""
    images, files, background = {}, {}, {}
    for k, name in enumerate(RIG.names):
        empty = scene((160, 120), seed=k, contrast=10.0)
        if k in pictures:
            light = np.where(TRUTH[k][..., None], DRAWN[k], empty)
            images[name] = write(folder / "example_poses" / "stand" / f"{name}.png", photo(light, k))
        if k in masks:
            mask = TRUTH[k].astype(np.uint8) * 255
            files[name] = write(folder / "example_poses" / "stand" / f"{name}.mask.png", mask)
        if k in plates:
            background[name] = write(folder / "background" / f"{name}.png", photo(empty, 50 + k))
    example = ExamplePose("stand", None, images, files, None)
    return replace(recording_of(RIG, 1), path=folder, example_poses=(example,), background=background)


def masks_of(recording):
    example = recording.example_poses[0]
    return example_masks(recording, example, load_images(recording, example))


def test_files_come_before_plates(tmp_path):
    found = masks_of(example_recording(tmp_path, masks=(0, 2), plates=(0, 1)))
    assert found.origins == {0: FROM_FILE, 1: FROM_PHOTOGRAPH, 2: FROM_FILE}
    assert list(found.masks) == [0, 1, 2]
    np.testing.assert_array_equal(found.masks[0], TRUTH[0])
    assert iou(found.masks[1], TRUTH[1]) > 0.85
    assert found.warnings == ()


def test_plates_alone_suffice(tmp_path):
    recording = example_recording(tmp_path, plates=(0, 1, 2, 3))
    pictures = load_pictures(recording, recording.example_poses[0])
    assert list(pictures.masks) == [0, 1, 2, 3] == list(pictures.images)
    for k, mask in pictures.masks.items():
        assert iou(mask, TRUTH[k]) > 0.85


def test_only_the_part_of_a_mask_that_the_subject_is_in_counts(tmp_path):
    recording = example_recording(tmp_path, masks=(0, 1, 2, 3))
    example = recording.example_poses[0]
    left = np.zeros((60, 80), bool)
    left[:, :40] = True
    within = {"cam0": left, "cam1": np.ones((120, 160), bool), "cam2": np.ones((60, 80), bool)}
    found = example_masks(recording, replace(example, within=within), load_images(recording, example))
    everything = found.masks | found.left_out
    assert sorted(everything) == [0, 1, 2], "cam3 shows others before it"
    assert not everything[0][:, 80:].any()
    np.testing.assert_array_equal(everything[1], TRUTH[1])


def test_a_mask_of_something_else_is_left_out_and_said(tmp_path):
    recording = example_recording(tmp_path, masks=(0, 1, 2, 3))
    wrong = np.zeros((120, 160), np.uint8)
    wrong[60:110, 5:40] = 255
    write(recording.example_poses[0].masks["cam2"], wrong)
    found = masks_of(recording)
    assert list(found.masks) == [0, 1, 3]
    np.testing.assert_array_equal(found.left_out[2], wrong > 0)
    assert found.origins[2] == FROM_FILE
    said = load_pictures(recording, recording.example_poses[0]).warnings
    assert len(said) == 1
    assert "'stand': cam2 is left out" in said[0]
    assert "cam2.mask.png" in said[0]


def test_pictures_of_all_example_poses_come_in_their_order_each_counted(tmp_path):
    recordings = [
        example_recording(tmp_path / name, masks=masks) for name, masks in (("a", (0, 1, 2)), ("b", (1, 2, 3)))
    ]
    examples = [replace(each.example_poses[0], name=f"pose_{k}") for k, each in enumerate(recordings)]
    counted = []

    def progress(items, total, label):
        for item in items:
            counted.append((total, label))
            yield item

    found = load_all_pictures(recordings[0], examples, progress=progress)
    assert [posed.name for posed in found] == ["pose_0", "pose_1"]
    assert [list(posed.masks) for posed in found] == [[0, 1, 2], [1, 2, 3]]
    assert counted == [(2, "masks")] * 2


def test_a_mask_that_lacks_a_part_is_not_said_to_disagree(tmp_path):
    recording = example_recording(tmp_path, masks=(0, 1, 2, 3))
    rows = np.flatnonzero(TRUTH[2].any(axis=1))
    half = TRUTH[2] & (np.arange(120) < rows.mean())[:, None]
    write(recording.example_poses[0].masks["cam2"], half.astype(np.uint8) * 255)
    found = masks_of(recording)
    assert list(found.masks) == [0, 1, 3]
    (said,) = found.warnings
    assert "cam2 is left out, since the other cameras agree better without its mask" in said
    assert "%" not in said


def test_where_furniture_hides_the_room_masks_say_nothing(tmp_path):
    """A table before the legs in two of four cameras, and nobody knows what is behind it."""
    recording = example_recording(tmp_path)
    example, learnt, tables = replace(recording.example_poses[0], frame=0), [], {}
    pictures = {k: image.copy() for k, image in load_images(recording, recording.example_poses[0]).items()}
    for k in range(4):
        rows, columns = np.nonzero(TRUTH[k])
        table = np.zeros((120, 160), bool)
        if k in (1, 2):
            table[int(np.median(rows)) : 118, columns.min() - 12 : columns.max() + 12] = True
        pictures[k][table] = (30 * k, 80, 220)
        empty = np.where(table[..., None], pictures[k], photo(scene((160, 120), seed=k, contrast=10.0), 50 + k))
        learnt.append(BackgroundImage(empty.astype(np.uint8), np.full((120, 160), 2.0, np.float32), ~table, "clip"))
        tables[k] = table
    found = example_masks(recording, example, pictures, learnt)
    assert sorted(found.masks) == [0, 1, 2, 3]
    assert found.undecided
    for k, mask in found.masks.items():
        assert iou(mask & ~tables[k], TRUTH[k] & ~tables[k]) > 0.8
        if k in (1, 2):
            assert found.untold[k][tables[k] & ~mask].all()
            assert mask[tables[k]].mean() < 0.1


def test_who_is_hidden_in_all_cameras_leaves_the_masks_as_colours_tell(tmp_path):
    """Nothing at all is certain where the background is unknown around the whole subject."""
    recording = example_recording(tmp_path)
    example, learnt = replace(recording.example_poses[0], frame=0), []
    images = load_images(recording, recording.example_poses[0])
    for k in range(4):
        empty = photo(scene((160, 120), seed=k, contrast=10.0), 50 + k)
        around = cv2.dilate(TRUTH[k].astype(np.uint8), np.ones((25 + 14 * k, 25))) > 0
        learnt.append(BackgroundImage(empty, np.where(around, 6.0, 2.0).astype(np.float32), ~around, "clip"))
    found = example_masks(recording, example, images, learnt)
    assert len(found.masks) >= 2
    assert not found.undecided
    assert not found.untold


def test_what_is_painted_in_front_is_told_by_no_mask(tmp_path):
    recording = example_recording(tmp_path, masks=(0, 1, 2, 3))
    painted = np.zeros((120, 160), np.uint8)
    painted[60:, :80] = 255
    recording = replace(recording, occluders={"cam1": write(tmp_path / "occluders" / "cam1.png", painted)})
    found = masks_of(recording)
    assert list(found.untold) == [1]
    np.testing.assert_array_equal(found.untold[1], (painted > 0) & ~TRUTH[1])
    assert not found.undecided


def test_two_masks_that_do_not_fit_are_said(tmp_path):
    recording = example_recording(tmp_path, masks=(0, 1))
    wrong = TRUTH[1].copy()
    wrong[: np.nonzero(wrong)[0].mean().astype(int)] = False
    write(recording.example_poses[0].masks["cam1"], wrong.astype(np.uint8) * 255)
    found = masks_of(recording)
    assert list(found.masks) == [0, 1]
    assert "cam0 and cam1 agree by only" in found.warnings[0]


def test_a_plate_that_is_not_empty_is_left_out_and_said(tmp_path):
    recording = example_recording(tmp_path, masks=(0, 1), plates=(3,))
    write(recording.background["cam3"], cv2.imread(str(recording.example_poses[0].images["cam3"])))
    found = masks_of(recording)
    assert list(found.masks) == [0, 1]
    assert "cam3 is left out" in found.warnings[0]
    assert str(recording.background["cam3"]) in found.warnings[0]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({}, ("'stand' has 0 pictures with a mask", "CAMERA.mask.png", "background", "cam0, cam1, cam2, cam3")),
        ({"masks": (1,)}, ("'stand' has 1 picture with a mask", "for cam0, cam2, cam3")),
        ({"pictures": (2,), "masks": (2,)}, ("'stand' has pictures of 1 of the cameras", "at least two")),
    ],
)
def test_too_little_to_make_masks_from(tmp_path, given, words):
    recording = example_recording(tmp_path, **given)
    with pytest.raises(InputError) as refused:
        masks_of(recording)
    assert str(tmp_path / "example_poses" / "stand") in str(refused.value)
    for word in words:
        assert word in str(refused.value)
    assert "\n" not in str(refused.value)


def test_plates_from_which_no_subject_can_be_told(tmp_path):
    recording = example_recording(tmp_path, plates=(0, 1))
    for k in (0, 1):
        write(recording.background[f"cam{k}"], cv2.imread(str(recording.example_poses[0].images[f"cam{k}"])))
    with pytest.raises(InputError, match=r"in the pictures of cam0, cam1 no subject.*CAMERA\.mask\.png"):
        masks_of(recording)


def beside_others(folder, others):
    """What is found of a dog whose region ends halfway up, where the background around it is not known."""
    recording = example_recording(folder)
    lower = {name: rows_below(mask, middle(mask)) for name, mask in zip(RIG.names, TRUTH, strict=True)}
    example = replace(recording.example_poses[0], frame=0, within=lower, others=others)
    images, learnt = load_images(recording, recording.example_poses[0]), []
    for k, mask in enumerate(TRUTH):
        around = cv2.dilate(mask.astype(np.uint8), np.ones((13, 13))) > 0
        empty = photo(scene((160, 120), seed=k, contrast=10.0), 50 + k)
        learnt.append(BackgroundImage(empty, np.full((120, 160), 2.0, np.float32), ~around, "clip"))
    found = example_masks(recording, example, images, learnt)
    assert len(found.masks) >= 3
    for k, mask in found.masks.items():
        assert not (mask & ~lower[RIG.names[k]]).any()
    return found


def middle(mask):
    return float(np.nonzero(mask)[0].mean())


def rows_below(mask, row):
    return mask & (np.arange(len(mask)) > row)[:, None]


def test_what_is_cut_off_beside_others_is_not_said_to_be_nobody(tmp_path):
    nobody = np.zeros((60, 80), bool)
    found = beside_others(tmp_path, dict.fromkeys(RIG.names, nobody))
    for k, mask in found.masks.items():
        assert found.untold[k][TRUTH[k] & ~rows_below(TRUTH[k], middle(TRUTH[k]))].mean() > 0.9
        assert not (found.untold[k] & mask).any()
        assert not found.untold[k][cv2.dilate(TRUTH[k].astype(np.uint8), np.ones((31, 31))) == 0].any()


def test_where_another_person_is_the_subject_is_not(tmp_path):
    upper = {name: mask & ~rows_below(mask, middle(mask)) for name, mask in zip(RIG.names, TRUTH, strict=True)}
    found = beside_others(tmp_path, {name: mask for name, mask in upper.items() if name != RIG.names[1]})
    for k in found.masks:
        assert not found.untold.get(k, np.zeros_like(TRUTH[k]))[upper[RIG.names[k]]].any()
    assert 1 not in found.untold, "nothing is known of the others"
