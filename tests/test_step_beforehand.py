"""The step that is compiled while the first pose is searched for: for whom, with which frame, and from which pose."""

from dataclasses import replace

import numpy as np
import pytest
from run_cases import DOG, pose_request, tiny_run

from sogjax.errors import InputError
from sogjax.run import clip_search, passes
from sogjax.run.clip_search import ClipSearch
from sogjax.run.initial_pose import InitialPose
from sogjax.search.placed_body import centres_of
from sogjax.search.places import Place
from sogjax.tracking.frame import FrameInput

FRAMES = {frame: FrameInput(np.zeros((2, 4, 4, 3), np.uint8)) for frame in (0, 5)}
REST = np.asarray(DOG.poses["rest"])
INITIAL_POSE = next(each for each in passes.PASSES if each.name == "initial_pose")


def place(x, y, z):
    return Place(np.array([x, y, z]), np.array([0.0, 0.0, 1.0]), 2.0, 1.0, 1.0)


def searched(bodies, found, monkeypatch):
    """What is told of places that are found in two searches."""

    def search_poses(searchers, make, num_frames, report, told):
        told(found)
        return []

    told, request = [], pose_request()
    monkeypatch.setattr(clip_search, "search_poses", search_poses)
    monkeypatch.setattr(type(request.clip), "frames", lambda clip, *numbers: iter([FRAMES[numbers[0]]]))
    search = ClipSearch(request.clip, request.background, bodies, request.config, told=lambda *seen: told.append(seen))
    for frame in FRAMES:
        search.paths(frame)
    return told


@pytest.mark.parametrize("places", [[(1.0, 0.0, 0.5), (-1.0, 2.0, 0.5)], [(1.0, 0.0, 0.5)]])
def test_bodies_at_rest_are_told_of_once_one_in_each_place(monkeypatch, places):
    bodies = [DOG, replace(DOG, name="other")]
    ((frame, pose),) = searched(bodies, [place(*at) for at in places], monkeypatch)
    assert frame is FRAMES[0]
    of_each = np.split(pose, 2)
    for body, own, at in zip(bodies, of_each, (places[0], places[-1]), strict=True):
        np.testing.assert_allclose(centres_of(body, own[None])[0], at, atol=1e-4)


@pytest.fixture
def compiled(monkeypatch):
    """The frames for which a step was compiled."""
    steps = []
    monkeypatch.setattr(passes, "compile_beforehand", lambda setup: None)
    monkeypatch.setattr(passes, "compile_step", lambda tracker, frame, at_rest: steps.append((frame, at_rest)))
    return steps


def source(request):
    if request.told is not None:
        request.told(FRAMES[5], REST)
    return InitialPose(0, REST, "search")


@pytest.mark.parametrize("takes_steps", [True, False])
def test_a_step_is_compiled_only_for_runs_that_take_it(compiled, takes_steps):
    run = replace(tiny_run(), pose_sources=[source], takes_steps=takes_steps)
    assert INITIAL_POSE.make(run).source == "search"
    assert [(frame is FRAMES[5], pose is REST) for frame, pose in compiled] == [(True, True)] * takes_steps


def test_a_search_that_refuses_waits_for_no_step(compiled):
    def refusing(request):
        raise InputError("nobody is there")

    with pytest.raises(InputError, match="nobody is there"):
        INITIAL_POSE.make(replace(tiny_run(), pose_sources=[refusing]))
    assert not compiled
