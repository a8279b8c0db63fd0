"""A limb that lies on something else shows other colours than its counterpart."""

from dataclasses import replace

import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import draw, moved, standing
from rig_cases import recording_of, ring_rig
from run_cases import DOG, stand_in_passes, tiny_run

from sogjax.actor.colors import colored
from sogjax.actor.limb_colors import limb_pairs_alike
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.io.motion import motion_from_poses
from sogjax.run import clip_sides, judge
from sogjax.run.actors import Actors
from sogjax.run.clip_sides import UNLIKE, colors_apart, unlike_where_tracked
from sogjax.run.initial_pose import InitialPose
from sogjax.run.runner import run_passes

RIG = ring_rig(4, (320, 240), distance=3.5)
HUMAN = shipped("human")
FRAMES = 3


def dressed():
    """A body in a blue suit whose arms are yellow."""
    colors = np.tile([0.1, 0.2, 0.7], (HUMAN.num_blobs, 1))
    for blobs in limb_pairs_alike(HUMAN)[1].blobs:
        colors[blobs] = [0.9, 0.8, 0.1]
    return colored(HUMAN, colors)


def distances(monkeypatch, tracked):
    """Of a body that stands with its arms out, tracked in another pose."""
    body, truth = (
        dressed(),
        moved(HUMAN, standing(HUMAN, 1.0), {"left_shoulder_raise": -1.2, "right_shoulder_raise": 1.2}),
    )
    images = draw(body, truth, RIG)
    monkeypatch.setattr(clip_sides, "read_chosen", lambda recording, frames: [(frame, images) for frame in frames])
    motion = motion_from_poses(body, np.tile(moved(HUMAN, truth, tracked), (FRAMES, 1)), 25.0)
    return colors_apart(recording_of(RIG, FRAMES), {"a": (body, motion)}, "lab")["a"]


@pytest.mark.parametrize(("one", "other", "alike"), [(0.9, 0.5, True), (0.5, 0.5, True), (0.9, [0.5, 0.4, 0.5], False)])
def test_an_arm_in_the_shade_is_no_other_arm(one, other, alike):
    skin = np.array([[0.8, 0.6, 0.4]])
    assert (clip_sides._apart(one * skin, np.array(other) * skin) < UNLIKE) == alike


@pytest.mark.parametrize(("tracked", "lost"), [({}, False), ({"left_shoulder_raise": 0.1}, True)])
def test_an_arm_that_is_not_where_it_is_tracked_shows_something_else(monkeypatch, tracked, lost):
    apart = distances(monkeypatch, tracked)
    arms = next(name for name in apart if "arm" in name)
    assert (apart[arms] > UNLIKE) == lost
    assert all(distance < UNLIKE for name, distance in apart.items() if name != arms)
    said = unlike_where_tracked(apart)
    assert (said is not None) == lost
    assert said is None or f"{arms} ({apart[arms]:.3f} apart)" in said


def judged(monkeypatch, compared, **recording):
    """What is thought of a dog that was made of frames of the videos."""
    begun = InitialPose(0, np.zeros(DOG.skeleton.num_dofs, np.float32), "search")
    actors = Actors((DOG,), doubts=("",), unlike=("",))
    run = run_passes(tiny_run(actors=actors, initial_pose=begun), stand_in_passes())
    run.clip = replace(run.clip, recording=replace(run.clip.recording, **recording))
    monkeypatch.setattr(judge, "colors_apart", compared)
    return judge.judged_result(run).verdicts["dog"].findings


def test_it_is_a_finding_of_the_verdict(monkeypatch):
    apart = {"left front leg or right front leg": 0.2}
    compared = lambda recording, actors, space: dict.fromkeys(actors, apart)
    assert unlike_where_tracked(apart) in judged(monkeypatch, compared)
    example = ExamplePose("stand", None, {}, {}, None, 0)
    assert unlike_where_tracked(apart) not in judged(
        monkeypatch, compared, example_poses=(example,)
    )  # somebody chose it


def test_videos_that_cannot_be_read_once_more_end_no_run(monkeypatch, capsys):
    def unreadable(*_):
        raise InputError("cam0.mp4: is gone")

    judged(monkeypatch, unreadable)
    assert "not compared: cam0.mp4: is gone" in "".join(capsys.readouterr())
