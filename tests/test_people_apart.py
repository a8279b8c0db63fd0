"""Several people in a clip: parts of the hull that stand apart, who is who, and the example poses that they give."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from rig_cases import opencv_pixels, recording_of, ring_rig

from sogjax.actor.frame_choice import SeenShape, seen_shape, subject_cubes
from sogjax.actor.people import PersonSeen, _needed, matched, people_apart, runs_by_place, told_apart, unlike
from sogjax.io.example_poses import ExamplePose
from sogjax.io.pose_description import PoseDescription
from sogjax.run.example_frames import _found_otherwise, _suit, seen_shapes
from sogjax.run.example_people import chosen_frames, examples_of_masks, told_by_name, too_few_apart
from sogjax.run.sampled_masks import SampledMasks
from sogjax.scene.cells import CellGrid
from sogjax.scene.visual_hull import VoxelPixels

SIZE = (320, 240)
RIG = ring_rig(6, SIZE, distance=4.0)
CAMERAS = {k: RIG.camera(name) for k, name in enumerate(RIG.names)}
UP = np.array([0.0, 0.0, 1.0])
NOTHING = {k: np.zeros(SIZE[::-1], bool) for k in CAMERAS}
RED, BLUE = (30, 30, 200), (200, 40, 30)
ALONG, ACROSS = np.array([np.cos(0.3), np.sin(0.3)]), np.array([-np.sin(0.3), np.cos(0.3)])
"""Directions on the floor: towards camera 0 and away from camera 3, and at right angles."""


def box(place, low=0.0, high=1.7, half=0.2):
    """The corners of an upright box on a place of the floor (metres)."""
    steps = [(x, y, z) for x in (-half, half) for y in (-half, half) for z in (low, high)]
    return np.array([*place, 0.0]) + np.array(steps)


def seen_boxes(boxes):
    """Masks and pictures of boxes in their colours, by camera; a later one is in front."""
    masks, pictures = {}, {}
    for k, name in enumerate(RIG.names):
        picture = np.zeros((*SIZE[::-1], 3), np.uint8)
        for corners, color in boxes:
            outline = cv2.convexHull(opencv_pixels(RIG, name, corners).round().astype(np.int32))
            cv2.fillConvexPoly(picture, outline, color)
        masks[k], pictures[k] = picture.any(axis=-1), picture
    return masks, pictures


def people_of(boxes, frame=0, count=0):
    masks, pictures = seen_boxes(boxes)
    (cube,) = subject_cubes([masks], CAMERAS)
    assert cube is not None
    return people_apart(frame, masks, NOTHING, pictures, CAMERAS, cube, UP, count)


def test_two_people_are_two_parts_with_their_own_places_regions_and_colours():
    people = people_of([(box(-0.7 * ALONG), RED), (box(0.7 * ALONG), BLUE)])
    first, second = sorted(people, key=lambda person: float(person.place[:2] @ ALONG))
    np.testing.assert_allclose(first.place[:2], -0.7 * ALONG, atol=0.06)
    np.testing.assert_allclose(second.place[:2], 0.7 * ALONG, atol=0.06)
    assert unlike(first.colors, second.colors) > 0.8
    both = set(first.regions) & set(second.regions)
    assert both == {1, 2, 4, 5}, "cameras 0 and 3 see one behind the other"
    for k in both:
        assert not (first.regions[k] & second.regions[k]).any()
    masks, _ = seen_boxes([(box(-0.7 * ALONG), RED)])
    for k in both:
        overlap = (first.masks[k] & masks[k]).sum() / (first.masks[k] | masks[k]).sum()
        assert overlap > 0.9


def test_people_who_touch_are_cut_apart_where_two_are_asked_for():
    arm = np.array([[*along * ALONG, z] for along in (-0.45, 0.45) for z in (1.2, 1.3)])
    boxes = [(box(-0.45 * ALONG), RED), (arm, RED), (box(0.45 * ALONG, high=1.6), BLUE)]
    assert len(people_of(boxes)) == 1
    people = people_of(boxes, count=2)
    first, second = sorted(people, key=lambda person: float(person.place[:2] @ ALONG))
    np.testing.assert_allclose(first.place[:2], -0.45 * ALONG, atol=0.1)
    np.testing.assert_allclose(second.place[:2], 0.45 * ALONG, atol=0.1)
    assert unlike(first.colors, second.colors) > 0.6
    assert first.regions
    assert not {0, 3} & set(first.regions), "cameras 0 and 3 see one behind the other"


def test_one_person_is_not_cut_in_two():
    arms = np.array([[*along * ALONG, z] for along in (-0.8, 0.8) for z in (1.3, 1.45)])
    assert len(people_of([(box((0.0, 0.0)), RED), (arms, RED)], count=2)) == 1
    legs = [(box(side * ALONG, high=0.9, half=0.1), RED) for side in (-0.3, 0.3)]
    assert len(people_of([*legs, (box((0.0, 0.0), low=0.8), RED)], count=2)) == 1


def test_shadows_on_the_floor_join_nobody():
    floor = np.array([[x, y, z] for x in (-0.7, 0.7) for y in (-0.15, 0.15) for z in (0.0, 0.01)])
    assert len(people_of([(floor, (9, 9, 9)), (box((-0.7, 0.0)), RED), (box((0.7, 0.0)), BLUE)])) == 2


def test_a_gap_at_the_belt_makes_no_two_people():
    halves = [box((0.0, 0.0), 0.0, 0.9), box((0.0, 0.0), 1.0, 1.7)]
    assert len(people_of([(half, RED) for half in halves])) == 1


def test_a_forearm_beside_somebody_is_a_piece_of_him():
    forearm = np.array([[x, y, z] for x in (0.35, 0.6) for y in (-0.06, 0.06) for z in (0.4, 1.2)])
    assert len(people_of([(box((0.0, 0.0)), RED), (forearm, RED)])) == 1


def test_advice_is_neither_followed_already_nor_refused_in_turn():
    assert "empty scene" in too_few_apart(2, [0, 0])
    assert "empty scene" not in too_few_apart(2, [0, 0], plates=True)
    assert "give actors=3" in too_few_apart(2, [3, 3, 3, 2])
    assert "give actors" not in too_few_apart(2, [1, 1, 1, 2, 2])  # who pass are seen as one
    assert "give actors" not in too_few_apart(2, [3, 3, 1, 1, 2])


def test_a_part_of_the_hull_that_no_camera_shows_apart_is_nobody():
    """Two people, and what two cameras allow between them: in each it is before or behind one of both."""

    class Seen(VoxelPixels):
        def __init__(self, *columns):
            object.__setattr__(self, "columns", columns)  # of the voxels

        def silhouette_of(self, voxels):
            shown = np.zeros((4, 8), bool)
            for k in np.flatnonzero(voxels):
                shown[:, self.columns[k] : self.columns[k] + 2] = True
            return shown

    parts = [np.arange(3) == k for k in range(3)]
    pixels = {0: Seen(0, 4, 0), 1: Seen(0, 4, 4)}
    masks = {k: pixels[k].silhouette_of(parts[0]) | pixels[k].silhouette_of(parts[1]) for k in pixels}
    assert [part.tolist() for part in _needed(parts, masks, pixels)] == [part.tolist() for part in parts[:2]]
    everybody = {k: Seen(0, 4, 6) for k in range(2)}
    masks = {k: np.any([everybody[k].silhouette_of(part) for part in parts], axis=0) for k in everybody}
    assert len(_needed(parts, masks, everybody)) == 3


def moment(frame, *people):
    """People at places (metres along a line) with a share of the first of two colours."""
    empty = {}
    return [PersonSeen(frame, np.array([x, 0.0, 1.0]), empty, empty, empty, np.array([c, 1.0 - c])) for x, c in people]


def test_places_tell_while_nobody_can_have_changed_places():
    moments = [moment(0, (0.0, 0.5), (2.0, 0.5)), moment(3, (2.1, 0.5), (0.1, 0.5)), moment(6, (0.2, 0.5), (2.2, 0.5))]
    (run,) = runs_by_place(moments, 30.0)
    assert [[round(float(person.place[0]), 1) for person in people] for people in run] == [
        [0.0, 2.0],
        [0.1, 2.1],
        [0.2, 2.2],
    ]
    assert len(runs_by_place([moments[0], moment(60, (0.0, 0.5), (2.0, 0.5))], 30.0)) == 2


def test_colours_tell_after_a_while_and_people_alike_are_left_out():
    early = [moment(k, (0.0, 0.9), (2.0, 0.1)) for k in range(3)]
    late = [moment(300, (0.0, 0.2), (2.0, 0.8))]
    told = told_apart([*early, *late], 30.0)
    assert [float(people[0].colors[0]) for people in told] == [0.9, 0.9, 0.9, 0.8]
    alike = [moment(300, (0.0, 0.5), (2.0, 0.52))]
    assert [people[0].frame for people in told_apart([*early, *alike], 30.0)] == [0, 1, 2]
    assert told_apart([], 30.0) == []


def test_the_margin_is_what_exchanging_two_would_cost():
    order, margin = matched(np.array([[0.9, 0.1, 0.9], [0.2, 0.9, 0.9], [0.9, 0.9, 0.3]]))
    assert order == [1, 0, 2]
    assert margin == pytest.approx(0.9 + 0.9 - 0.3 - 0.2)


def sampled(clip, first=0):
    """What would be sampled of a clip of boxes, a list of them for each frame."""
    seen = [seen_boxes(boxes) for boxes in clip]
    return SampledMasks(
        frames=[first + frame for frame in range(len(clip))],
        masks=[masks for masks, _ in seen],
        pictures=[pictures for _, pictures in seen],
        unknown=NOTHING,
        calm=NOTHING,
        cameras=CAMERAS,
        grids=tuple(CellGrid(*SIZE, 1) for _ in CAMERAS),
    )


def screened():
    """Somebody who walks before six cameras: one sees a screen, two others his trousers before it, in its colour."""
    seen = sampled([[(box(at * ALONG), RED)] for at in (-0.4, 0.0, 0.4)])
    for masks in seen.masks:
        masks[0][:] = False
        for k in (1, 3):
            rows = np.flatnonzero(masks[k].any(axis=1))
            masks[k][rows[len(rows) // 2] : rows[2 * len(rows) // 3]] = False
    return seen


def test_who_is_hidden_from_some_cameras_is_seen_by_the_others():
    seen = screened()
    assert not _suit(seen_shapes(seen, "z"))
    found = next(filter(_suit, _found_otherwise(seen, "z", False)))
    assert [shape.num_bodies for shape in found] == [1, 1, 1]
    assert min(shape.height for shape in found) > 1.5
    assert len([*_found_otherwise(seen, "z", True)]) == 1
    everywhere = replace(seen, masks=[masks | {0: masks[3]} for masks in seen.masks])
    assert [*_found_otherwise(everywhere, "z", True)] == []  # he is seen by all, if not apart from others
    few = replace(seen, masks=[{k: masks[k] for k in (1, 2, 3, 4)} for masks in seen.masks])
    assert [*_found_otherwise(replace(few, cameras={k: CAMERAS[k] for k in (1, 2, 3, 4)}), "z", False)] == []


def passing(count):
    """Two people who go past each other, beside each other for all cameras in some frames."""
    away = np.linspace(-0.2, 0.2, count)
    return [[(box(-0.7 * ACROSS + a * ALONG), RED), (box(0.7 * ACROSS - a * ALONG), BLUE)] for a in away]


@pytest.mark.slow
def test_each_person_has_example_poses_in_the_same_frames():
    recording = recording_of(RIG, 4, first_frame=10)
    examples = examples_of_masks(recording, sampled(passing(4), first=10), 2, 3)
    assert not isinstance(examples, str)
    assert [example.actor for example in examples] == ["person_1"] * 3 + ["person_2"] * 3
    frames = [example.frame for example in examples]
    assert frames[:3] == frames[3:] == sorted(frames[:3], key=str)
    assert examples[0].name == f"frame_{frames[0]}"
    for one, other in zip(examples[:3], examples[3:], strict=True):
        assert one.within is not None
        assert other.within is not None
        for camera in set(one.within) & set(other.within):
            assert one.within[camera].shape == SIZE[::-1]
            assert not (one.within[camera] & other.within[camera]).any()


@pytest.mark.slow
def test_who_stands_where_nothing_is_known_is_found_by_colour():
    seen = sampled(passing(2))
    noise = np.random.default_rng(0).integers(-9, 10, (*SIZE[::-1], 3))
    pictures = [
        {k: (noise + np.where(of_frame[k].any(-1, keepdims=True), of_frame[k], 110)).clip(0, 255).astype(np.uint8)
         for k in of_frame}
        for of_frame in seen.pictures
    ]  # fmt: skip
    around = {k: cv2.dilate(mask.astype(np.uint8), np.ones((41, 41))) > 0 for k, mask in seen.masks[0].items()}
    hidden = replace(seen, pictures=pictures, unknown=around, masks=[NOTHING, NOTHING])
    assert isinstance(examples_of_masks(recording_of(RIG, 2), hidden, 2, 2), str)
    decided = hidden.decided(np.array([0.0, 0.0, 1.0]))
    for found, truth in zip(decided.masks, seen.masks, strict=True):
        assert min((found[k] & truth[k]).sum() / (found[k] | truth[k]).sum() for k in truth) > 0.9
    assert not isinstance(examples_of_masks(recording_of(RIG, 2), decided, 2, 2), str)


def test_no_common_frame_leaves_all_unknown():
    empty = replace(sampled(passing(2)), frames=[], masks=[], pictures=[])
    assert empty.decided(np.array([0.0, 0.0, 1.0])) is empty


@pytest.mark.slow
@pytest.mark.parametrize(
    ("clip", "actors", "words"),
    [
        (passing(3), 3, ("actors=3", "2 people in 3", "give actors=2")),
        ([boxes[:1] for boxes in passing(3)], 2, ("actors=2", "one person in 3", "give actors=1")),
        ([[(corners, RED) for corners, _ in passing(5)[2]]], 2, ("in 1 of 1 frame",)),
    ],
)
def test_clips_that_show_other_numbers_of_people_are_refused(clip, actors, words):
    problem = examples_of_masks(recording_of(RIG, len(clip)), sampled(clip), actors, 3)
    assert isinstance(problem, str)
    for word in words:
        assert word in problem


@pytest.mark.slow
def test_people_in_the_same_clothes_are_refused_where_places_do_not_tell():
    clip = [[(corners, RED) for corners, _ in boxes] for boxes in passing(4)]
    recording, seen = recording_of(RIG, 4), sampled(clip)
    assert not isinstance(examples_of_masks(recording, seen, 2, 3), str)
    problem = examples_of_masks(replace(recording, fps=0.5), seen, 2, 3)
    assert isinstance(problem, str)
    assert "who is who" in problem


def listed(frame, actor, position=None):
    pose = None if position is None else PoseDescription(pose=None, position=position, heading=None, landmarks={})
    return ExamplePose(f"frame_{frame}", actor, {}, {}, pose, frame)


def test_a_frame_shows_several_actors_each_where_its_rough_pose_is():
    clip = [[(box((-0.7, 0.0)), RED), (box((0.7, 0.0)), BLUE)]]
    for first, second in (("man", "woman"), ("woman", "man")):
        entries = [listed(0, first, (0.6, 0.1, 0.9)), listed(0, second)]
        told = told_by_name(recording_of(RIG, 1), sampled(clip), entries)
        assert not isinstance(told, str)
        assert [each.actor for each in told] == [first, second]
        _, pictures = seen_boxes(clip[0])
        blue, red = told
        assert blue.within
        for name, region in blue.within.items():
            picture = pictures[RIG.names.index(name)]
            assert (picture[region] == BLUE).all(axis=-1).sum() > 20 * (picture[region] == RED).all(axis=-1).sum()
        assert red.within


def test_a_frame_that_shows_other_numbers_than_it_is_listed_for_is_refused():
    clip = [[(box((-0.7, 0.0)), RED)]]
    problem = told_by_name(recording_of(RIG, 1), sampled(clip), [listed(0, "man"), listed(0, "woman")])
    assert isinstance(problem, str)
    assert "frame 0 is listed for 2 actors" in problem
    assert "1 person" in problem


def test_what_lies_beside_most_pictures_is_nobody():
    """A man near two cameras, which cut off his feet: beneath their pictures they would allow anything."""
    place = 1.5 * ALONG - 1.1 * ACROSS
    people = people_of([(box(place), RED), (box(place - 1.0 * ALONG + 0.3 * ACROSS), BLUE)])
    assert len(people) == 2
    man = min(people, key=lambda person: float(np.linalg.norm(person.place[:2] - place)))
    (cube,) = subject_cubes([man.masks], CAMERAS)
    assert cube is not None
    shape = seen_shape(0, man.masks, NOTHING, CAMERAS, cube, UP)
    assert shape is not None
    assert shape.agreement > 0.9


def shape_of(frame, agreement, side=8):
    voxels = np.zeros((16, 16, 16), bool)
    voxels[:side, :8, :8] = True
    return SeenShape(frame, 1, 1.0, agreement, 0.3, 1.7, 1.0, voxels)


def test_a_frame_in_which_one_of_two_is_seen_well_serves_for_that_one():
    first = {frame: shape_of(frame, 0.8, 4 + frame) for frame in range(5)}
    second = {frame: shape_of(frame, 0.8 if frame in (2, 3) else 0.2, 4 + frame) for frame in range(5)}
    chosen = chosen_frames([first, second], 4)
    assert chosen[1] == [2, 3]
    assert len(chosen[0]) == 4
    assert {2, 3} <= set(chosen[0])
