"""When the limbs of actors take the colours that they show where they were tracked."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from frame_table_cases import frame_table
from run_cases import DOG, tiny_run

from sogjax.actor.colors import colored
from sogjax.actor.limb_colors import limb_pairs_alike
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.io.frame_table import FramesRecord
from sogjax.io.motion import motion_from_poses
from sogjax.model.limbs import limb_names
from sogjax.run import passes, recolor_actors
from sogjax.run.actors import Actors
from sogjax.run.initial_pose import InitialPose
from sogjax.run.recolor_actors import RecoloredActors, named_limbs, recolored

HUMAN = shipped("human")
SKIN, RED, BLUE = np.array([0.8, 0.6, 0.5]), np.array([0.8, 0.1, 0.1]), np.array([0.1, 0.2, 0.7])
ARMS = next(pair for pair in limb_pairs_alike(HUMAN) if "arm" in limb_names(HUMAN)[pair.limbs[0]])
FRAMES, POSE = 4, np.zeros((4, DOG.skeleton.num_dofs), np.float32)
LEG, LIMBS = limb_names(DOG)[limb_pairs_alike(DOG)[0].limbs[0]], len(limb_names(DOG))
LEGS = "left leg and right leg"
UNLIKE = Actors((DOG,), doubts=("",), unlike=(f"{LEG} was not found",))
POSES = np.tile(POSE, 2)
BOTH = Actors(
    (replace(DOG, name="rex"), replace(DOG, name="bello")), doubts=("", ""), unlike=(f"{LEG} was not found", "")
)
BEGUN = InitialPose(1, POSE[1], "example frames")


def person(left, right):
    """Blue, with arms of two colours."""
    colors = np.tile(BLUE, (HUMAN.num_blobs, 1))
    for blobs, color in zip(ARMS.blobs, (left, right), strict=True):
        colors[blobs] = color
    return colored(HUMAN, colors)


def shown(*arms):
    """What frames show of somebody whose left and right arms have these colours in them."""
    bodies = [person(*of_frame).blob_colors for of_frame in arms]
    return {frame: [np.tile(color, (20, 1)) for color in np.asarray(colors)] for frame, colors in enumerate(bodies)}


@pytest.mark.parametrize(
    ("frames", "expected"),
    [
        ([(SKIN, SKIN)] * FRAMES, SKIN),  # both were tracked rightly
        ([(SKIN, SKIN), (SKIN, SKIN), (SKIN, RED), (SKIN, BLUE)], SKIN),  # one was not in every frame
        ([(SKIN, BLUE)] * FRAMES, None),  # it may be lost everywhere, or its sleeve may be blue
    ],
)
def test_an_arm_that_was_not_found_takes_the_colours_that_it_shows_over_the_clip(frames, expected):
    body, told = recolored(person(SKIN, RED), {"right arm"}, shown(*frames), "lab")
    if expected is None:
        assert not told
        np.testing.assert_array_equal(body.blob_colors, person(SKIN, RED).blob_colors)
        return
    assert told == ["left arm and right arm"]
    np.testing.assert_allclose(body.blob_colors, person(expected, expected).blob_colors, atol=0.02)


@pytest.mark.parametrize(("left", "taken"), [(0.7 * SKIN, True), (RED, False)])
def test_sleeves_that_differ_are_taken_where_those_of_the_actor_differ_far_more(left, taken):
    frames = shown(*[(left, SKIN)] * FRAMES)
    assert bool(recolored(person(BLUE, SKIN), {"left arm"}, frames, "lab")[1]) == taken


@pytest.mark.parametrize(("named", "arms"), [("left arm", (0.95 * SKIN, SKIN)), ("left leg", (RED, RED))])
def test_who_looks_as_he_did_keeps_his_colours_and_so_do_limbs_that_nothing_is_said_of(named, arms):
    body, told = recolored(person(SKIN, SKIN), {named}, shown(*[arms] * FRAMES), "lab")
    assert not told
    np.testing.assert_array_equal(body.blob_colors, person(SKIN, SKIN).blob_colors)


@pytest.mark.parametrize("seen", [0, 20])
def test_limbs_that_are_hardly_seen_keep_their_colours(seen):
    frames = shown(*[(SKIN, SKIN)] * FRAMES)
    for samples in frames.values():
        for blobs in ARMS.blobs:
            for blob in blobs:
                samples[blob] = samples[blob][:seen]
    assert bool(recolored(person(SKIN, RED), {"right arm"}, frames, "lab")[1]) == bool(seen)


def doubtful(*values):
    """The frames of dogs, of which each limb is so doubtful."""
    return replace(frame_table(POSES), limb_doubt=np.tile(np.array(values)[:, None], 2 * LIMBS))


def tracked_again(monkeypatch, said, doubt, actors=BOTH, both_ways=False):
    """What comes of two dogs, one of which is told to look otherwise, whose limbs are so doubtful then."""
    going = tiny_run("actor=null", "every=2", frames=2 * FRAMES, actors=actors, initial_pose=BEGUN)
    going.clip = replace(going.clip, numbers=range(0, 2 * FRAMES, 2))
    begun = []

    def track(setup, begin, times, again):
        assert again
        begun.append((np.asarray(setup.tracker.body.blob_colors), begin))
        return doubtful(*[doubt] * FRAMES)

    def recolor(body, named, *_):
        assert bool(named) == (body.name == "rex")
        other = colored(body, np.full((DOG.num_blobs, 3), 0.25))
        return (other, [said]) if said and named else (body, [])

    def merge(setup, table, known):
        begun.append(known)
        return FramesRecord(table)

    monkeypatch.setattr(recolor_actors, "colors_by_frame", lambda _, actors, free: {name: {} for name in actors})
    monkeypatch.setattr(recolor_actors, "recolored", recolor)
    monkeypatch.setattr(recolor_actors, "track_forward", track)
    monkeypatch.setattr(recolor_actors, "merge_backward", merge)
    first = replace(doubtful(0.03, 0.02, 0.01, 0.02), frame=np.arange(0, 2 * FRAMES, 2))
    found = recolor_actors.recolor_actors(going.setup, actors, first, "lab", going.setup_with, both_ways)
    return found, first, begun


@pytest.mark.parametrize("both_ways", [False, True])
def test_the_clip_is_tracked_again_in_the_new_colours(monkeypatch, both_ways):
    found, first, begun = tracked_again(monkeypatch, LEGS, 0.01, both_ways=both_ways)
    assert found.table is not first
    assert found.actors.unlike == BOTH.unlike
    new, kept = (np.asarray(body.blob_colors) for body in found.actors.bodies)
    np.testing.assert_allclose(new, 0.25)
    np.testing.assert_array_equal(kept, DOG.blob_colors)
    np.testing.assert_array_equal(begun[0][0], np.concatenate([new, kept]))
    assert begun[0][1].frame == 4  # the surest one
    assert [known is first.pose for known in begun[1:]] == [True] * both_ways


@pytest.mark.parametrize(("said", "doubt"), [("", 0.01), (LEGS, 0.5)])
def test_it_stays_where_nothing_looks_otherwise_or_limbs_are_more_doubtful_then(monkeypatch, said, doubt):
    found, first, begun = tracked_again(monkeypatch, said, doubt)
    assert found.table is first
    assert found.actors is None
    assert bool(begun) == bool(said)


def test_nothing_is_read_where_nothing_is_said_of_a_limb(monkeypatch):
    going = tiny_run("actor=null", frames=FRAMES)
    monkeypatch.setattr(recolor_actors, "colors_by_frame", None)
    table = frame_table(POSES[:, : DOG.skeleton.num_dofs])
    found = recolor_actors.recolor_actors(going.setup, going.actors, table, "lab", going.setup_with, both_ways=True)
    assert found.table is table


def test_videos_that_cannot_be_read_once_more_end_no_run(monkeypatch, capsys):
    def unreadable(*_):
        raise InputError("cam0.mp4: is gone")

    monkeypatch.setattr(recolor_actors, "named_limbs", lambda *_: {LEG})
    going = tiny_run("actor=null", frames=FRAMES)
    monkeypatch.setattr(recolor_actors, "colors_by_frame", unreadable)
    table = frame_table(POSES[:, : DOG.skeleton.num_dofs])
    found = recolor_actors.recolor_actors(going.setup, going.actors, table, "lab", going.setup_with, both_ways=True)
    assert found.table is table
    assert "keep the actors' colours: cam0.mp4: is gone" in "".join(capsys.readouterr())


@pytest.mark.parametrize(
    ("frames", "hidden", "unlike", "named"),
    [
        (0, 0.0, "", False),
        (0, 0.0, f"{LEG} was not found", True),
        (1, 0.0, "", False),  # of thirty
        (2, 0.0, "", True),
        (2, 1.0, "", False),
    ],
)
def test_limbs_are_named_that_are_often_in_doubt_unless_something_hides_them(frames, hidden, unlike, named):
    motion = motion_from_poses(DOG, np.zeros((30, DOG.skeleton.num_dofs)), 25.0, limb_names=limb_names(DOG))
    doubts = np.zeros((30, LIMBS))
    doubts[:frames, limb_names(DOG).index(LEG)] = 0.9
    motion = replace(motion, limb_doubt=doubts, limb_hidden=np.full((30, LIMBS), hidden))
    assert named_limbs(DOG, motion, unlike) == ({LEG} if named else set())
    rivalled = replace(motion, limb_unlike=np.zeros_like(doubts))  # it looks like itself
    assert named_limbs(DOG, rivalled, unlike) == ({LEG} if unlike else set())
    slightly = replace(motion, limb_unlike=np.full_like(doubts, 0.35), limb_rival=np.zeros_like(doubts))
    assert named_limbs(DOG, slightly, unlike) == ({LEG} if unlike else set())  # rivals do not count
    assert named_limbs(DOG, replace(motion, limb_doubt=None, limb_hidden=None), "") == set()


@pytest.mark.parametrize("actors", [None, UNLIKE])
def test_what_was_tracked_again_is_kept(tmp_path, actors):
    assert RecoloredActors.load(tmp_path) is None
    RecoloredActors(frame_table(POSE), actors).save(tmp_path)
    kept = RecoloredActors.load(tmp_path)
    if actors is not None:
        np.testing.assert_array_equal(kept.actors.bodies[0].blob_colors, actors.bodies[0].blob_colors)
    np.testing.assert_array_equal(kept.table.pose, POSE)
    assert (kept.actors is None) == (actors is None)
    (tmp_path / recolor_actors.FOLDER / recolor_actors.LAST).unlink()
    assert RecoloredActors.load(tmp_path) is None  # it was stopped before all was kept


def test_a_run_goes_on_with_the_new_colours():
    going = tiny_run(actors=UNLIKE, initial_pose=BEGUN)
    going.records["recolored"] = RecoloredActors(frame_table(POSE))
    assert going.actors is UNLIKE
    other = replace(UNLIKE, bodies=(colored(DOG, np.full((DOG.num_blobs, 3), 0.25)),))
    going.records["recolored"] = RecoloredActors(frame_table(POSE), other)
    assert going.actors is other
    np.testing.assert_array_equal(going.frames.pose, POSE)


def test_actors_that_are_given_or_shared_or_made_of_chosen_frames_keep_their_colours():
    wanted = next(each for each in passes.PASSES if each.name == "recolored").wanted
    assert not wanted(tiny_run("actor=null", actors=UNLIKE))  # given from Python
    assert not wanted(made_itself("actor=dog.yaml"))
    going = made_itself("actor=null")
    assert wanted(going)
    going.pose_sources = (lambda request: BEGUN,)
    assert not wanted(going)
    chosen = made_itself("actor=null")
    example = ExamplePose("sit", None, {}, {}, None, 0)
    chosen.clip = replace(chosen.clip, recording=replace(chosen.clip.recording, example_poses=(example,)))
    assert not wanted(chosen)


def made_itself(*words):
    """A run that found actors itself."""
    going = tiny_run(*words, actors=UNLIKE)
    going.actors_given = False
    return going
