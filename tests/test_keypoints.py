"""Keypoints of other programs: told by their content, brought to the recording's frames, refused with a sentence."""

import json

import numpy as np
import pytest
from damaged import FUZZ, damaged
from hypothesis import given
from keypoint_cases import people, person, write_keypoints
from slow_values import fast_and_slow
from small_recording import make_recording, write_images

from sogjax.errors import InputError
from sogjax.io.camera_names import matched_names
from sogjax.io.keypoint_files import find_keypoints
from sogjax.io.keypoints.formats import read_pictures
from sogjax.io.keypoints.load import load_keypoints
from sogjax.io.keypoints.scheme import load_scheme, named_scheme, other_side, shipped_schemes
from sogjax.io.recording import open_recording

PROGRAMS = ("openpose", "pose2sim", "mmpose", "alphapose", "mediapipe")
JSON_PROGRAMS = PROGRAMS[:-1]


@pytest.fixture
def folder(tmp_path):
    return make_recording(tmp_path / "walk")


def loaded(folder, /, **options):
    return load_keypoints(open_recording(folder), **options)


@pytest.mark.parametrize("program", PROGRAMS)
def test_what_a_program_wrote_is_read_back(folder, program):
    persons = 1 if program == "mediapipe" else 2
    written = write_keypoints(folder / "keypoints", program, persons=persons)
    found = loaded(folder)
    assert found.cameras == ("left", "right")
    assert found.warnings == ()
    expected = np.array(written)
    if program == "mediapipe":
        expected[..., 2] = 1.0
    for camera in found.points:
        for frame, people_there in zip(camera, expected, strict=True):
            order = sorted(range(persons), key=lambda k: -people_there[k, :, 2].sum())
            np.testing.assert_allclose(frame, people_there[order], atol=1e-3)
    assert found.seeing == ("left", "right")
    with pytest.raises(ValueError, match="read-only"):
        found.points[0] = 0.0


@pytest.mark.parametrize("scheme", ["BODY_25", "BODY_25B", "COCO_18", "COCO_17", "HALPE_26", "COCO_133", "HALPE_136"])
def test_the_scheme_is_told_by_the_content(folder, scheme):
    write_keypoints(folder / "keypoints", "openpose", scheme=scheme)
    assert loaded(folder).scheme.name == scheme


def test_each_keypoint_means_what_its_scheme_says():
    """Facts of the programs' documentation, picked by hand."""
    expected = {
        "BODY_25": {"Neck": 1, "RWrist": 4, "LKnee": 13, "LHeel": 21, "RBigToe": 22},
        "COCO_18": {"RHip": 8, "LAnkle": 13, "LEar": 17},
        "BODY_25B": {"RWrist": 10, "Neck": 17, "LBigToe": 19, "RHeel": 24},
        "COCO_17": {"LShoulder": 5, "RAnkle": 16},
        "HALPE_26": {"Head": 17, "Hip": 19, "RBigToe": 21, "LHeel": 24},
        "COCO_133": {"LBigToe": 17, "RHeel": 22, "LHand": 100},
        "MEDIAPIPE_33": {"LShoulder": 11, "RHip": 24, "LHeel": 29, "RBigToe": 32},
    }
    schemes = shipped_schemes()
    for name, places in expected.items():
        scheme = schemes[name]
        assert {k: scheme.indices[scheme.keypoints.index(k)] for k in places} == places
        sided = zip(scheme.keypoints, scheme.landmarks, strict=True)
        assert all(("left" in landmark) == (key[0] == "L") for key, landmark in sided)
        np.testing.assert_array_equal(scheme.mirrored[scheme.mirrored], np.arange(len(scheme.keypoints)))


def test_every_landmark_of_a_scheme_is_one_of_the_human():
    from body_cases import shipped

    for scheme in shipped_schemes().values():
        assert (scheme.on(shipped("human").landmarks.names) >= 0).all()
        assert (scheme.on(("nose",)) == -1).sum() == len(scheme.keypoints) - 1


def test_another_scheme_is_another_file(folder, tmp_path):
    path = tmp_path / "mine.yaml"
    rows = "".join(
        f"  - {{name: {name}, index: {k}, landmark: {landmark}, within: 0.05}}\n"
        for k, (name, landmark) in enumerate([("LKnee", "left_knee"), ("RKnee", "right_knee"), ("Nose", "nose")])
    )
    path.write_text(f"name: MINE\ncount: 4\nkeypoints:\n{rows}")
    write_keypoints(folder / "keypoints", scheme=str(path))
    found = loaded(folder, scheme=str(path))
    assert (found.scheme.name, found.points.shape) == ("MINE", (2, 4, 1, 3, 3))
    with pytest.raises(InputError, match=r"4 keypoints, as in no known scheme .*BODY_25 25.*keypoint_scheme"):
        loaded(folder)


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("name: A\ncount: 3\n", "keypoints"),
        ("name: A\ncount: 3\nkeypoints: []\n", "at least one row"),
        ("name: A\ncount: 3\nkeypoints: [{name: N, index: 3, landmark: nose, within: 0}]\n", "from 0 to 2"),
        ("name: A\ncount: 3\nkeypoints: [{name: N, index: 0, landmark: nose, within: -1}]\n", "metres"),
        (
            "name: A\ncount: 3\nkeypoints: [{name: N, index: 0, landmark: nose, within: 0}, "
            "{name: M, index: 0, landmark: neck, within: 0}]\n",
            "no other keypoint",
        ),
    ],
)
def test_a_file_that_is_no_scheme_is_refused(tmp_path, text, word):
    (tmp_path / "mine.yaml").write_text(text)
    with pytest.raises(InputError, match=word):
        load_scheme(tmp_path / "mine.yaml")


def test_an_unknown_scheme_is_refused_with_those_that_are_known():
    with pytest.raises(InputError, match=r"'BODY_26'.*BODY_25"):
        named_scheme("BODY_26")


def test_a_recording_without_keypoints_has_none(folder, tmp_path):
    assert find_keypoints(folder) is None
    assert loaded(folder) is None
    with pytest.raises(InputError, match="holds no keypoints"):
        loaded(folder, folder=tmp_path)


def test_mmposes_demo_counts_pictures_from_one(tmp_path):
    instance = {"keypoints": [[1.0, 2.0]], "keypoint_scores": [0.5]}
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"meta_info": {}, "instance_info": [{"frame_id": 1, "instances": [instance]}]}))
    (picture,) = read_pictures(path)
    assert picture.number == 0
    np.testing.assert_array_equal(picture.people[0], [[1.0, 2.0, 0.5]])


def test_files_of_missing_pictures_leave_those_frames_empty(folder):
    write_keypoints(folder / "keypoints", there=np.array([True, False, True, True]))
    found = loaded(folder)
    np.testing.assert_array_equal((found.confidence > 0.0).any((2, 3)), [[True, False, True, True]] * 2)


def test_time_offsets_and_the_first_frame_count(folder):
    (folder / "recording.yaml").write_text("up: z\nframe_offset: {right: 1}\nfirst_frame: 1\n")
    written = write_keypoints(folder / "keypoints")
    found = loaded(folder)
    assert found.num_frames == 2
    for camera, first in enumerate((1, 2)):
        np.testing.assert_allclose(found.points[camera], written[first : first + 2], atol=1e-3)


def test_pictures_counted_from_one_are_told(folder):
    write_keypoints(folder / "keypoints")
    for camera in ("left", "right"):
        files = sorted((folder / "keypoints" / camera).iterdir())
        for number, file in reversed([*enumerate(files, 1)]):
            file.rename(file.with_name(f"{camera}_{number:012d}_keypoints.json"))
    np.testing.assert_allclose(loaded(folder).points[0], people(named_scheme("BODY_25")), atol=1e-3)


def test_numbers_of_image_folders_are_their_names(tmp_path):
    folder = make_recording(tmp_path / "walk")
    for camera in ("left", "right"):
        (folder / "videos" / f"{camera}.mp4").unlink()
        write_images(folder / "images" / camera, first=7)
    (folder / "recording.yaml").write_text("up: z\nfps: 25\n")
    write_keypoints(folder / "keypoints")
    for camera in ("left", "right"):
        files = sorted((folder / "keypoints" / camera).iterdir())
        for number, file in reversed([*enumerate(files, 7)]):
            file.rename(file.with_name(f"{number:06d}_keypoints.json"))
    np.testing.assert_allclose(loaded(folder).points[1], people(named_scheme("BODY_25")), atol=1e-3)


def test_freemocaps_array_is_read_in_the_order_of_the_videos(folder):
    scheme = named_scheme("MEDIAPIPE_33")
    array = np.full((2, 4, 553, 2), np.nan)
    for camera in range(2):
        array[camera][:, list(scheme.indices)] = people(scheme)[:, 0, :, :2] + camera
    place = folder / "output_data/raw_data/mediapipe_2dData_numCams_numFrames_numTrackedPoints_pixelXY.npy"
    place.parent.mkdir(parents=True)
    np.save(place, array)
    found = loaded(folder)
    np.testing.assert_allclose(found.pixels[1, :, 0], people(scheme)[:, 0, :, :2] + 1, atol=1e-3)
    np.save(place, array[:, :3])
    with pytest.raises(InputError, match="has 3 frames, the video 4"):
        loaded(folder)
    np.save(place, array[:1])
    with pytest.raises(InputError, match="of 1 camera, the recording has 2 videos"):
        loaded(folder)


def test_other_programs_names_of_cameras_are_matched():
    assert matched_names(["cam01", "cam10"], ["int_cam10_img", "int_cam01_img"]) == {
        "cam01": "int_cam01_img",
        "cam10": "int_cam10_img",
    }
    assert matched_names(["Camera_000"], ["camera 0"]) == {"Camera_000": "camera 0"}
    assert matched_names(["a", "b"], ["b", "a", "a 1"]) == {"a": "a", "b": "b"}
    assert matched_names(["cam"], ["cam_1", "cam_2"]) == {}
    assert matched_names(["left"], ["right"]) == {}


def test_left_and_right_of_a_name():
    assert [other_side(name) for name in ("LKnee", "right_knee", "Neck", "Left wrist")] == [
        *("RKnee", "left_knee", "Neck", "Right wrist")
    ]


def change(path, **people_changes):
    """Write other values into a file of OpenPose."""
    content = json.loads(path.read_text())
    for one in content["people"]:
        one.update(people_changes)
    path.write_text(json.dumps(content))


def first_file(folder, camera="left"):
    return sorted((folder / "keypoints" / camera).iterdir())[0]


def no_json(folder):
    first_file(folder).write_text("no json")
    return "1 file of 4 left out", "left_000000000000_keypoints.json", "not valid JSON"


def of_other_pictures(folder):
    for file in (folder / "keypoints/left").iterdir():
        values = np.array(json.loads(file.read_text())["people"][0]["pose_keypoints_2d"]).reshape(-1, 3)
        values[:, :2] *= 3.0
        change(file, pose_keypoints_2d=values.ravel().tolist())
    return "keypoints/left", "outside the camera's pictures of 64x48", "left is used without"


def shares_of_the_picture(folder):
    for file in (folder / "keypoints/left").iterdir():
        change(file, pose_keypoints_2d=[0.5, 0.5, 0.9] * 25)
    return "keypoints/left", "shares of the picture", "keypoint_scale 0"


def of_another_clip(folder):
    first_file(folder).rename(folder / "keypoints/left/left_000000000099_keypoints.json")
    return "keypoints/left", "the pictures 1 to 99", "has 4 images"


def of_a_shorter_clip(folder):
    for file in sorted((folder / "keypoints/left").iterdir())[2:]:
        file.unlink()
    return "keypoints/left", "ends with the picture 2 of 4"


def without_people(folder):
    for file in (folder / "keypoints/left").iterdir():
        file.write_text('{"version": 1.3, "people": []}')
    return "keypoints/left", "nobody"


def people_without_keypoints(folder):
    for file in (folder / "keypoints/left").iterdir():
        change(file, pose_keypoints_2d=[0.0] * 75)
    return "keypoints/left", "nobody"


def nothing_but_nan(folder):
    for file in (folder / "keypoints/left").iterdir():
        change(file, pose_keypoints_2d=[float("nan")] * 75)
    return "keypoints/left", "nobody"


def twice_a_picture(folder):
    file = first_file(folder)
    (file.parent / "other_000000000000_keypoints.json").write_text(file.read_text())
    return "the picture 0 occurs twice", "left is used without"


def without_one_camera(folder):
    (folder / "keypoints/left").rename(folder / "keypoints/third")
    return "has no keypoints of left"


FAULTS_OF_ONE = (
    no_json, of_other_pictures, shares_of_the_picture, of_another_clip, of_a_shorter_clip, without_people,
    people_without_keypoints, nothing_but_nan, twice_a_picture, without_one_camera,
)  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS_OF_ONE)
def test_what_is_wrong_with_one_camera_is_said_and_the_others_go_on(folder, fault):
    written = write_keypoints(folder / "keypoints")
    words = fault(folder)
    found = loaded(folder)
    assert len(found.warnings) == 1
    for word in [words] if isinstance(words, str) else words:
        assert word in found.warnings[0]
    assert "\n" not in found.warnings[0]
    np.testing.assert_allclose(found.points[1], written, atol=1e-3)


def test_single_numbers_that_are_none_are_keypoints_that_were_not_found(folder):
    write_keypoints(folder / "keypoints")
    values = person(named_scheme("BODY_25"))
    values[3, 0] = np.nan
    values[4, 2] = np.nan
    change(first_file(folder), pose_keypoints_2d=values.ravel().tolist())
    found = loaded(folder)
    assert np.isfinite(found.points).all()
    np.testing.assert_array_equal(np.flatnonzero(found.confidence[0, 0, 0] == 0.0), [3, 4])


def test_files_of_which_none_can_be_used_are_refused(folder):
    write_keypoints(folder / "keypoints", cameras=("third", "fourth"))
    with pytest.raises(InputError, match="are of fourth, third, the recording's cameras are left, right"):
        loaded(folder)
    write_keypoints(folder / "keypoints")
    for file in (folder / "keypoints").rglob("*.json"):
        file.write_text("[{")
    with pytest.raises(InputError, match="not valid JSON"):
        loaded(folder)


def test_people_of_two_schemes_are_refused(folder):
    write_keypoints(folder / "keypoints", cameras=("left",))
    write_keypoints(folder / "keypoints", cameras=("right",), scheme="COCO_17")
    with pytest.raises(InputError, match=r"have 25 keypoints, those of .* 17"):
        loaded(folder)
    with pytest.raises(InputError, match="17 keypoints, those of BODY_25 have 25"):
        loaded(folder, scheme="BODY_25")


def test_too_many_people_are_said(folder):
    write_keypoints(folder / "keypoints", persons=20)
    found = loaded(folder)
    assert found.points.shape[2] == 16
    assert "up to 20 people" in found.warnings[0]


@pytest.mark.parametrize("program", fast_and_slow(*JSON_PROGRAMS))
def test_damaged_files_are_read_or_refused(tmp_path, program):
    write_keypoints(tmp_path / "good", program, cameras=("a",), scheme="COCO_17", frames=1)
    good = next((tmp_path / "good").rglob("*.json")).read_text()
    path = tmp_path / "a_000.json"

    @FUZZ
    @given(damaged(good))
    def read(text):
        path.write_text(text, encoding="utf-8")
        said = ""
        try:
            pictures = read_pictures(path)
        except InputError as error:
            said, pictures = str(error), []
        assert "\n" not in said
        assert all(np.isfinite(one).all() for picture in pictures for one in picture.people)

    read()


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        '{"people": [{"pose_keypoints_2d": [[[[]]]]}]}',
        '{"people": [{"pose_keypoints_2d": "abc"}]}',
        '{"people": [{"pose_keypoints_2d": [1, 2]}]}',
        '{"people": [3]}',
        '[{"image_id": "a.jpg", "keypoints": [1, 2, 3]}]',
        '[{"image_id": [], "keypoints": [1, 2, 3]}]',
        '[{"frame_id": "x", "instances": []}]',
        '[{"frame_id": 0, "instances": 5}]',
        '[{"frame_id": 0, "instances": [{"keypoints": [[1, 2]], "keypoint_scores": [1, 2]}]}]',
        '{"people": [' + ",".join(['{"pose_keypoints_2d": [1, 1, 1]}'] * 101) + "]}",
        "{}",
        "5",
    ],
)
def test_json_that_is_no_keypoints_is_refused(tmp_path, text):
    path = tmp_path / "a.json"
    path.write_text(text)
    with pytest.raises(InputError, match=r"a\.json"):
        read_pictures(path)


@pytest.mark.parametrize("content", [b"no npy", b"\x93NUMPY\x01\x00"])
def test_npy_files_that_are_none_are_refused(folder, content):
    for camera in ("left", "right"):
        place = folder / "keypoints" / f"{camera}.npy"
        place.parent.mkdir(exist_ok=True)
        place.write_bytes(content)
    with pytest.raises(InputError, match="npy"):
        loaded(folder)
