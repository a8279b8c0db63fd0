"""Furniture among the people, clothes, rooms and light that drifts, as the cameras see them."""

import hashlib
import json
from dataclasses import asdict, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from sogjax.errors import InputError
from sogjax.io.image_file import read_image
from sogjax.io.recording import open_recording
from sogjax.io.video import read_frames
from sogjax.synth.cache import cache_name
from sogjax.synth.clothes import outfits_from_seed
from sogjax.synth.filming import EmptyView, film
from sogjax.synth.flesh import PARTS
from sogjax.synth.landmarks import LANDMARKS, landmark_points
from sogjax.synth.picture import Shadows, plate_of, shot_of
from sogjax.synth.render import ground_truth_of, render_recording
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import stage_of

pytestmark = pytest.mark.slow

SMALL = SynthSettings(cameras=4, width=120, height=90, frames=3, seed=2, noise=0.0, camera_variation=0.0)


@cache
def stage(**changes):
    return stage_of(replace(SMALL, **changes))


@cache
def plates(**changes):
    made = stage(**changes)
    return [plate_of(made.scene, view) for view in made.views]


def masks(made, empty, frame):
    """What is seen of the people by each camera."""
    meshes = [person.posed(pose) for person, pose in zip(made.people, made.poses(frame), strict=True)]
    shadows = Shadows.of(meshes, made.scene.shadow)
    return [shot_of(view, p, made.people, meshes, shadows).mask for view, p in zip(made.views, empty, strict=True)]


def test_a_picture_is_that_of_the_empty_scene_but_where_people_and_their_shadows_are():
    made = stage(motion="arms", noise=0.02, camera_variation=0.1)
    meshes = [person.posed(pose) for person, pose in zip(made.people, made.poses(1), strict=True)]
    for view, sensor in zip(made.views, made.sensors, strict=True):
        plate = plate_of(made.scene, view)
        shot = shot_of(view, plate, made.people, meshes, Shadows.of(meshes))
        outside = np.ones(shot.mask.shape, bool)
        outside[shot.changed.slices] = False
        assert outside.any()
        assert not shot.mask[outside].any()
        assert np.array_equal(shot.light[outside], plate.total[outside])
        rng = lambda: np.random.default_rng(4)
        whole = sensor.exposed(shot.light, rng()).astype(int)
        assert np.abs(EmptyView(sensor, plate).recorded(shot, rng()) - whole).max() <= 1  # by rounding, if at all


def test_a_table_hides_legs_from_some_cameras_and_stands_in_the_plates():
    made, bare = stage(motion="arms", props="table"), stage(motion="arms")
    with_table, without = masks(made, plates(motion="arms", props="table"), 0), masks(bare, plates(motion="arms"), 0)
    left = [np.sum(some) / np.sum(all_) for some, all_ in zip(with_table, without, strict=True)]
    assert min(left) < 0.85  # somewhere legs are hidden
    assert max(left) > 0.99  # and from elsewhere they are not
    for some, all_ in zip(with_table, without, strict=True):
        assert not (some & ~all_).any()
        hidden = np.flatnonzero((all_ & ~some).any(1))
        seen = np.flatnonzero(all_.any(1))
        assert not len(hidden) or hidden.min() > seen.min() + 0.3 * np.ptp(seen)  # never head or chest
    for one, other in zip(plates(motion="arms", props="table"), plates(motion="arms"), strict=True):
        assert np.mean(np.abs(one.total - other.total).max(-1) > 0.05) > 0.02


def test_a_person_before_the_table_is_not_hidden_by_it():
    """A camera sees either the person or the table, whichever is nearer: checked against the table's depth."""
    made, empty = stage(motion="arms", props="table"), plates(motion="arms", props="table")
    mesh = made.people[0].posed(made.poses(0)[0])
    for view, plate, mask in zip(made.views, empty, masks(made, empty, 0), strict=True):
        pixels, depths = view.project(mesh.vertices)
        column, row = np.clip(np.round(pixels).astype(int), 0, [view.width - 1, view.height - 1]).T
        assert plate.props is not None
        table = plate.props[2 * row, 2 * column]
        before = depths < table - 0.3
        assert mask[row, column][before].mean() > 0.9
        behind = depths > table + 0.05
        if behind.sum() > 50:
            assert mask[row, column][behind].mean() < 0.35


def test_furniture_throws_shadows_on_legs():
    made = stage(motion="sit")
    mesh = made.people[0].posed(made.motions[0](1.5))
    low = mesh.vertices[mesh.vertices[:, 2] < 0.3].astype(np.float32)
    alone, among = Shadows.of([mesh]), Shadows.of([mesh], made.scene.shadow)
    assert among.lit(low).mean() < 0.8 * alone.lit(low).mean()


def test_example_poses_are_taken_without_furniture(tmp_path):
    settings = replace(SMALL, motion="sit", cameras=1, frames=1)
    made = stage_of(settings)
    assert made.bare.props is None
    assert made.scene.props is not None
    pictures = len(list(film(made, [0], tmp_path)))
    assert pictures == 1 + 4 + 1


@pytest.mark.parametrize("kind", ["cluttered", "camouflage", "plain", "green"])
def test_rooms(kind):
    picture = np.concatenate([plate.total for plate in plates(room=kind)])
    greenish = np.mean(picture[..., 1] > 1.5 * picture[..., [0, 2]].max(-1))
    assert (greenish > 0.6) == (kind == "green")
    edges = np.mean(np.abs(np.diff(picture, axis=1)).max(-1) > 0.1)
    assert (edges > 0.02) == (kind in ("cluttered", "camouflage"))
    red, green, blue = stage(room=kind).people[0].outfit.shirt[0]
    assert kind != "green" or green <= max(red, blue)


def test_camouflage_has_the_colors_of_the_people():
    """Most of what is seen of a camouflage room is as near to skin or clothes as their patterns are; another is not."""
    outfit = stage(room="camouflage").people[0].outfit
    worn = np.array([outfit.skin, *outfit.shirt, outfit.trousers, outfit.shoes, outfit.hair])
    textures = {k: [c for t in stage(room=k).scene.textures for c in t.colors] for k in ("camouflage", "cluttered")}
    near = {k: np.mean([np.abs(worn - c).max(1).min() < 1e-9 for c in cs]) for k, cs in textures.items()}
    assert near["camouflage"] > 0.9
    assert near["cluttered"] < 0.1


@pytest.mark.parametrize("kind", ["random", "patterned", "striped", "plain", "black_suit", "long_sleeves"])
def test_outfits(kind):
    made = stage_of(replace(SMALL, outfit=kind, actors=2, motion="pass", cameras=1))
    for figure in made.people:
        centres = figure.rest[figure.faces].mean(1)
        colors = figure.wardrobe.colors(figure.face_part, centres)
        leg, arm = (figure.face_part == PARTS.index(f"left_{name}") for name in ("leg", "arm"))
        thigh = colors[leg & (centres[:, 2] > 0.28 * figure.anatomy.stature)]
        assert (thigh.std(0).max() > 0.05) == (kind in ("patterned", "striped"))
        bare = np.mean(np.abs(colors[arm] - figure.outfit.skin).max(1) < 0.01)
        assert (bare < 0.45) == (kind != "random" or figure.outfit.sleeve > 1.0)
        if kind == "black_suit":
            assert np.median(colors[leg]) < 0.12
        if kind in ("plain", "black_suit"):
            assert figure.outfit.shirt[0] == figure.outfit.shirt[1] == figure.outfit.trousers == figure.outfit.shoes


def test_other_clothes_are_worn_by_the_same_people():
    usual, striped = (outfits_from_seed(np.random.default_rng(7), 3, kind) for kind in ("random", "striped"))
    assert [(o.skin, o.hair, o.shirt) for o in usual] == [(o.skin, o.hair, o.shirt) for o in striped]


def test_the_light_drifts_slowly_from_what_the_plates_show(tmp_path):
    settings = replace(SMALL, cameras=1, frames=5, light_drift=0.4, example_poses=False)
    recording = open_recording(render_recording(settings, tmp_path / "dusk", workers=1))
    plate = read_image(next(iter(recording.background.values()))).astype(float)
    frames = [frame[0].astype(float) for frame in read_frames(recording)]
    ceiling = (slice(0, 12), slice(None))
    level = [frame[ceiling].mean() / plate[ceiling].mean() for frame in frames]
    assert level[0] == pytest.approx(1.0, abs=0.04)
    assert level[-1] == pytest.approx(0.6 ** (1 / 2.2), abs=0.05)
    assert all(before > after - 1e-3 for before, after in pairwise(level))
    blue_to_red = [frame[ceiling][..., 0].mean() / frame[ceiling][..., 2].mean() for frame in (frames[0], frames[-1])]
    assert blue_to_red[1] < 0.97 * blue_to_red[0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"props": "sofa"}, "props='sofa' is not known; choose one of auto, none, table"),
        ({"outfit": "tuxedo"}, "outfit='tuxedo' is not known; choose one of random"),
        ({"room": "forest"}, "room='forest' is not known; choose one of cluttered"),
        ({"light_drift": 0.9}, "light_drift=0.9 is out of range"),
        ({"light_drift": float("nan")}, "light_drift=nan is out of range"),
        ({"motion": "hug"}, "actors=1: the motion hug needs two people; set actors=2"),
        ({"motion": "fight", "actors": 3}, "actors=3: the motion fight needs two people; set actors=2"),
        ({"motion": "talk", "actors": 1}, "actors=1: the motion talk needs two people; set actors=2"),
        ({"motion": "walk", "alone": True}, "alone=true: the motion walk is not one of two people"),
        ({"motion": "talk", "actors": 2, "alone": True}, "alone=true actors=2: one of two people is alone"),
        ({"motion": "sit", "props": "none"}, "props=none: the motion sit needs a chair"),
        ({"motion": "sit", "props": "fence"}, "props=fence: the motion sit needs a chair"),
        ({"motion": "pass", "actors": 2, "props": "table"}, "props=table: people who walk past each other"),
    ],
)
def test_settings_that_cannot_be_rendered_are_refused(change, message):
    with pytest.raises(InputError, match=message):
        replace(SMALL, **change).check()


def test_recordings_rendered_before_there_was_a_choice_keep_their_names():
    """The name is a hash of the settings; those of the first version were fewer."""
    first = ("motion", "actors", "cameras", "width", "height", "fps", "frames", "seed", "noise", "camera_variation")
    first += ("radius", "distortion", "example_poses", "background", "shadows")
    content = {"version": 2, **{name: asdict(SMALL)[name] for name in first}}
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:12]
    assert cache_name(SMALL) == f"walk1-{digest}"
    assert len({cache_name(replace(SMALL, **c)) for c in ({}, {"room": "green"}, {"props": "table"})}) == 3


def seen_joints(made, view, mask, frame=0):
    """Which true joints of the first person a camera has people's pixels at."""
    points = landmark_points(made.people[0].anatomy, made.poses(frame)[0])
    column, row = np.round(view.project(points)[0]).astype(int).T
    return dict(zip(LANDMARKS, mask[np.clip(row, 0, view.height - 1), np.clip(column, 0, view.width - 1)], strict=True))


def ring_of_masks(props):
    """Twelve cameras, and what they see of somebody who stands there."""
    chosen = {"motion": "stoop", "props": props, "cameras": 12}
    made = stage(**chosen)
    return made, masks(made, plates(**chosen), 0)


@pytest.mark.parametrize(
    ("props", "hidden", "seen", "cameras"),
    [
        ("counter", ("left_knee", "right_knee", "left_ankle"), ("head_top", "neck", "chest"), (3, 5)),
        ("board", ("pelvis",), ("left_ankle", "right_ankle", "head_top"), (3, 6)),
        ("screen", ("pelvis", "chest", "neck", "left_knee", "left_ankle"), (), (3, 3)),
        ("fence", ("left_knee", "right_knee", "left_ankle"), ("head_top", "neck", "chest"), (6, 6)),
    ],
)
def test_what_stands_in_front_hides_what_it_is_meant_to(props, hidden, seen, cameras):
    """True joints, from so many cameras; other joints are seen by all low cameras that would see them without it."""
    made, with_props = ring_of_masks(props)
    _, without = ring_of_masks("none")
    few = 0
    for number, (view, some, all_) in enumerate(zip(made.views, with_props, without, strict=True)):
        joints, bare = seen_joints(made, view, some), seen_joints(made, view, all_)
        assert not (some & ~all_).any()
        assert number % 2 or all(joints[name] or not bare[name] for name in seen)
        few += not any(joints[name] for name in hidden)
    assert cameras[0] <= few <= cameras[1]


def test_a_fence_is_before_low_cameras_and_a_screen_before_three_neighbours():
    for props, expected in (("fence", [0, 2, 4, 6, 8, 10]), ("screen", [0, 1, 2])):
        made, seen = ring_of_masks(props)
        hidden = [
            number
            for number, (view, mask) in enumerate(zip(made.views, seen, strict=True))
            if not seen_joints(made, view, mask)["left_knee"] and not seen_joints(made, view, mask)["right_knee"]
        ]
        assert hidden == expected


@pytest.mark.parametrize("props", ["counter", "board", "screen", "fence"])
def test_what_stands_in_front_is_in_the_plates_and_changes_no_truth(props):
    """Where people are hidden the empty scene shows something else than without it."""
    made, with_props = ring_of_masks(props)
    bare, without = ring_of_masks("none")
    hidden = np.stack(without) & ~np.stack(with_props)
    pictures = [np.stack([p.total for p in plates(motion="stoop", props=each, cameras=12)]) for each in (props, "none")]
    changed = np.abs(pictures[0] - pictures[1]).max(-1) > 0.01
    assert changed[hidden].mean() > 0.8
    truths = [ground_truth_of(each) for each in (made, bare)]
    np.testing.assert_array_equal(truths[0].joints, truths[1].joints)
    np.testing.assert_array_equal(truths[0].markers, truths[1].markers)


def test_people_who_dress_alike_keep_their_own_skin_and_hair():
    usual, alike = (outfits_from_seed(np.random.default_rng(7), 3, kind) for kind in ("random", "alike"))
    worn = lambda outfit: (outfit.shirt, outfit.trousers, outfit.shoes, outfit.pattern, outfit.sleeve)
    assert len({worn(outfit) for outfit in alike}) == 1
    assert len({worn(outfit) for outfit in usual}) == 3
    assert [(o.skin, o.hair) for o in alike] == [(o.skin, o.hair) for o in usual]


@pytest.mark.slow
def test_one_of_two_people_does_the_same_alone():
    """What two people cost a tracker is told by the first one alone: the same motion, clothes, cameras and room."""
    both, alone = stage(motion="talk", actors=2), stage(motion="talk", alone=True)
    assert len(alone.people) == len(alone.motions) == 1
    for frame in (0, 2):
        np.testing.assert_array_equal(both.poses(frame)[0].rotations, alone.poses(frame)[0].rotations)
        np.testing.assert_array_equal(both.poses(frame)[0].position, alone.poses(frame)[0].position)
    assert both.people[0].outfit == alone.people[0].outfit
