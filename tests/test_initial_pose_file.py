"""Rough poses are read in both their forms, for one actor and for several."""

import numpy as np
import pytest
from run_cases import pose_request

from sogjax.errors import InputError
from sogjax.io.pose_description import PoseDescription, load_initial_poses
from sogjax.run.clip_search import ClipSearch
from sogjax.run.initial_pose import from_file, say_who_is_elsewhere


@pytest.fixture
def path(tmp_path):
    return tmp_path / "initial_pose.yaml"


def test_the_two_forms_alone_and_together(path):
    path.write_text("landmarks: {pelvis: [0, 1.5, -2], toe: [1, 2, 3]}\n")
    expected = PoseDescription(landmarks={"pelvis": (0.0, 1.5, -2.0), "toe": (1.0, 2.0, 3.0)})
    assert load_initial_poses(path, ["Ann"]) == {"Ann": expected}
    path.write_text("pose: tpose\nposition: [1, 2, 3]\nheading: 90\n")
    assert load_initial_poses(path, ["Ann"])["Ann"] == PoseDescription("tpose", (1.0, 2.0, 3.0), 90.0)
    path.write_text("pose: {elbow: 0.5}\nlandmarks: {toe: [1, 2, 3]}\n")
    pose = PoseDescription({"elbow": 0.5}, landmarks={"toe": (1.0, 2.0, 3.0)})
    assert load_initial_poses(path, ["Ann"])["Ann"] == pose


def test_several_actors_are_a_mapping(path):
    path.write_text("Ann: {pose: rest}\nBob: {landmarks: {toe: [1, 2, 3]}}\n")
    poses = load_initial_poses(path, ["Bob", "Ann"])
    assert list(poses) == ["Bob", "Ann"]
    assert poses["Ann"] == PoseDescription("rest")
    path.write_text("Ann: {pose: rest}\n")
    assert load_initial_poses(path, ["Ann"]) == {"Ann": PoseDescription("rest")}


@pytest.mark.parametrize(
    ("content", "actors", "words"),
    [
        ("pose: rest", ["Ann", "Bob"], ("one actor", "Ann, Bob")),
        ("Ann: {pose: rest}", ["Ann", "Bob"], ("'Bob'",)),
        ("", ["Ann"], ("empty",)),
        ("{}", ["Ann"], ("landmarks",)),
        ("- 1", ["Ann"], ("mapping",)),
        ("heading: 3", ["Ann"], ("landmarks",)),
        ("pose: rest\nheading: north", ["Ann"], ("heading", "'north'")),
        ("pose: rest\nheading: .nan", ["Ann"], ("heading", "nan")),
        ("pose: rest\nposition: [1, 2]", ["Ann"], ("position", "[1, 2]")),
        ("pose: rest\nposition: [1, 2, .inf]", ["Ann"], ("position[2]", "inf")),
        ("pose: 3", ["Ann"], ("pose", "3")),
        ("pose: {elbow: bent}", ["Ann"], ("pose.elbow", "'bent'")),
        ("landmarks: [1, 2, 3]", ["Ann"], ("landmarks", "[1, 2, 3]")),
        ("landmarks: {toe: up}", ["Ann"], ("landmarks.toe", "'up'")),
        ("landmarks: {toe: [1, 2, .nan]}", ["Ann"], ("landmarks.toe[2]", "nan")),
        ("Ann: {pose: rest, place: [1, 2, 3]}", ["Ann"], ("Ann.place", "position")),
    ],
)
def test_wrong_values_are_named(path, content, actors, words):
    path.write_text(content)
    with pytest.raises(InputError) as error:
        load_initial_poses(path, actors)
    for word in (str(path), *words):
        assert word in str(error.value)


def test_poses_of_others_are_left_out(tmp_path):
    path = tmp_path / "initial_pose.yaml"
    path.write_text("Ann: {pose: rest, heading: 3}\nCarl: {pose: sit}")
    poses = load_initial_poses(path, ["Ann"])
    assert set(poses) == {"Ann"}
    assert poses["Ann"].heading == 3.0


@pytest.mark.parametrize(
    ("away", "words"),
    [
        (0.3, None),
        (2.5, "the nearest place that does is 2.5 m away"),
        (np.inf, "nothing in the pictures looks like it"),
    ],
)
def test_a_pose_where_nothing_looks_like_its_actor_is_doubted(tmp_path, monkeypatch, capsys, away, words):
    asked = []
    monkeypatch.setattr(ClipSearch, "away", lambda search, frame, poses: asked.append((frame, len(poses))) or [away])
    path = tmp_path / "pose.yaml"
    path.write_text("pose: rest\nposition: [0, 0, 0.5]\n")
    request = pose_request(f"initial_pose={path}")
    found = from_file(request)
    assert not asked
    say_who_is_elsewhere(request, found)
    assert asked == [(0, 1)]
    said = capsys.readouterr()
    assert ("warning" in said.out + said.err) == (words is not None)
    assert words is None or f"{path} puts dog where nothing looks like it in frame 0 ({words})" in said.out + said.err
