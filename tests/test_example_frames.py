"""Frames of the videos as example poses: which are chosen, which way somebody faces, and what is refused."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from rig_cases import recording_of, ring_rig
from run_cases import pose_request

from sogjax.actor.facing import Way, consistent_ways, disagreement, haste
from sogjax.actor.frame_choice import SHAPE_VOXELS, SeenShape, spread_choice, unlikeness
from sogjax.actor.make import MadeActor
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.run.actors import Actors, known_frames
from sogjax.run.clip import Clip
from sogjax.run.example_frames import check_actors, most_helpful, several_people, unsuitable
from sogjax.run.initial_pose import from_example_frames

AHEAD = np.array([1.0, 0.0, 0.0])


def shape(frame, part, **values):
    """A frame in which the body fills one of eight parts of the cube."""
    voxels = np.zeros((8, SHAPE_VOXELS**3 // 8), bool)
    voxels[part] = True
    given = {"num_bodies": 1, "whole": 1.0, "agreement": 0.8, "clear": 0.4, "height": 1.6, "known": 1.0}
    return SeenShape(frame=frame, voxels=voxels.reshape(3 * (SHAPE_VOXELS,)), **(given | values))


def test_frames_are_chosen_for_worth_and_for_shapes_not_seen_before():
    same = [shape(k, 0) for k in range(4)]
    other, poor = shape(7, 1), shape(8, 2, agreement=0.1)
    chosen = spread_choice([*same, poor, other], 3)
    assert {found.frame for found in chosen} == {0, 7, 8}
    assert [found.frame for found in chosen] == sorted(found.frame for found in chosen)
    assert unlikeness(same[0], same[1]) == 0.0
    assert unlikeness(same[0], other) == 1.0


@pytest.mark.parametrize(
    ("values", "words"),
    [({"num_bodies": 2}, "2 people"), ({"known": 0.1}, "same place"), ({"agreement": 0.2}, "nobody")],
)
def test_clips_that_show_no_one_person_apart_are_refused(values, words):
    shapes = [shape(k, k % 8) for k in range(9)]
    assert unsuitable(shapes, lambda: 0) is None
    problem = unsuitable([replace(one, **values) for one in shapes], lambda: 2)
    assert problem is not None
    assert words in problem


def test_one_person_seen_in_parts_is_no_reason_to_refuse():
    assert unsuitable([shape(k, k, num_bodies=2) for k in range(8)], lambda: 1) is None


@pytest.mark.parametrize(("seen", "first"), [(0, "actors=2"), (2, "actors=2"), (3, "actors=3")])
def test_the_first_remedy_for_several_people_is_an_actor_of_each(seen, first):
    sentence = several_people(seen)
    assert sentence.index(first) < sentence.index("example_poses")


@pytest.mark.parametrize(
    ("actors", "files", "words"),
    [
        (0, None, ("actors=0", "at least 1")),
        (3, 2, ("actors=3", "2 files", "leave actors out")),
        (3, None, ("actors=3", "2 actors (anna, ben)", "leave actors out")),
        (1, None, ("actors=1", "2 actors (anna, ben)")),
    ],
)
def test_another_number_of_actors_than_files_or_poses_have_is_refused(actors, files, words):
    poses = tuple(ExamplePose(name, name, {}, {}, None, k) for k, name in enumerate(("anna", "ben")))
    recording = replace(recording_of(ring_rig(2), 9), example_poses=poses)
    for right in (None, 2):
        check_actors(recording, right, files)
    with pytest.raises(InputError) as refusal:
        check_actors(recording, actors, files)
    for word in words:
        assert word in str(refusal.value)


class Made(MadeActor):
    """An actor that fits its frames to a given degree."""

    def __init__(self, fits, poses):
        object.__setattr__(self, "fits", fits)
        object.__setattr__(self, "frames", {f"frame_{frame}": frame for frame in fits})
        object.__setattr__(self, "example_poses", {f"frame_{k}": jnp.asarray(pose) for k, pose in poses.items()})

    def suitability(self, name):
        return self.fits[self.frames[name]]


def test_several_actors_begin_where_all_poses_are_known_and_the_worst_fits_best(capsys):
    recording = recording_of(ring_rig(2), 99)
    anna = Made({3: 0.9, 8: 0.8, 20: 0.99}, {3: [3.0], 8: [8.0], 20: [20.0]})
    ben = Made({3: 0.6, 8: 0.7}, {3: [30.0, 31.0], 8: [80.0, 81.0]})

    def found(made, start=0, every=1):
        clip = Clip(recording, recording.frames[start::every], 4)
        return from_example_frames(pose_request(clip=clip, actors=Actors((), known_frames(made))))

    assert found([anna, ben]).frame == 8
    np.testing.assert_array_equal(found([anna, ben]).pose, [8.0, 80.0, 81.0])
    assert found([anna, ben], start=9) is None
    assert found([anna, ben], every=7) is None
    assert "(3, 8) are not among those to track" in capsys.readouterr().err
    assert found([anna]).frame == 20


def test_what_would_help_most():
    assert "empty scene" in most_helpful([shape(0, 0, known=0.7)], 12)
    assert "cameras" in most_helpful([shape(0, 0)], 3)
    assert "T-pose" in most_helpful([shape(0, 0)], 12)


def test_colours_decide_where_the_fit_does_not():
    """Blue in front and red behind; in the second moment the wrong way fits a little better."""
    front, back = (
        np.array([[color, other]], float) for color, other in [((0, 0, 1), (1, 0, 0)), ((1, 0, 0), (0, 0, 1))]
    )
    fits = [(1.0, 0.9), (0.99, 1.0), (1.0, 0.9)]
    both = lambda of_moment, *colors: [Way(fit, AHEAD, seen) for fit, seen in zip(of_moment, colors, strict=True)]
    untimed = [None] * 3
    assert consistent_ways([both(of_moment, front, back) for of_moment in fits], untimed) == (0, 0, 0)
    assert consistent_ways([both(of_moment, front, front) for of_moment in fits[:2]], untimed[:2]) == (0, 1)
    assert disagreement([front, front]) == 0.0
    unseen = np.full_like(front, np.nan)
    assert disagreement([front, unseen]) == 0.0


def test_nobody_turns_round_in_an_instant():
    """In the second moment the wrong way fits a little better."""
    moments = [[Way(fit, AHEAD), Way(other, -AHEAD)] for fit, other in [(1.0, 0.98), (0.99, 1.0), (1.0, 0.98)]]
    assert consistent_ways(moments, [0.0, 0.3, 0.6]) == (0, 0, 0)
    assert consistent_ways([moments[k] for k in (0, 2, 1)], [0.0, 0.6, 0.3]) == (0, 0, 0)  # in any order
    assert consistent_ways(moments, [0.0, 2.0, 4.0]) == (0, 1, 0)
    assert consistent_ways(moments, [0.0, None, 0.6]) == (0, 1, 0)
    clear = [moments[0], [Way(0.9, AHEAD), Way(1.0, -AHEAD)], moments[2]]
    assert consistent_ways(clear, [0.0, 0.3, 0.6]) == (0, 1, 0)
    np.testing.assert_allclose(haste([AHEAD, -AHEAD], [0.0, 0.0]), 1.0)
    assert haste([AHEAD, -AHEAD], [0.0, 1.0]) == 0.0
