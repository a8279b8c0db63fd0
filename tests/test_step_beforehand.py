"""What is compiled beforehand: the step while the first pose is searched for, the search while actors are made."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from run_cases import DOG, pose_request, tiny_run

from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.run import clip_search, passes
from sogjax.run.actors import Actors
from sogjax.run.clip_search import ClipSearch
from sogjax.run.initial_pose import InitialPose, compile_sources
from sogjax.search.placed_body import centres_of
from sogjax.search.places import Place
from sogjax.tracking.frame import FrameInput

FRAMES = {frame: FrameInput(np.zeros((2, 4, 4, 3), np.uint8)) for frame in (0, 5)}
REST = np.asarray(DOG.poses["rest"])
ACTORS, INITIAL_POSE = (
    next(each for each in passes.PASSES if each.name == name) for name in ("actors", "initial_pose")
)


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


@pytest.mark.parametrize(
    ("words", "frames", "initial_poses", "searches"),
    [
        ((), [None, None], None, 1),
        ((), [], None, 0),
        ((), [None, 3], None, 0),
        ((), [None], "initial_pose.yaml", 0),
        (("initial_pose=auto",), [None], "initial_pose.yaml", 1),
    ],
)
def test_a_search_is_compiled_if_actors_are_made_of_pictures_that_tell_no_pose(
    monkeypatch, words, frames, initial_poses, searches
):
    done, request = [], pose_request(*words)
    examples = tuple(ExamplePose(str(k), None, {}, {}, None, frame) for k, frame in enumerate(frames))
    path = None if initial_poses is None else Path(initial_poses)
    recording = replace(request.clip.recording, example_poses=examples, initial_poses=path)
    monkeypatch.setattr(ClipSearch, "compile_beforehand", lambda search: done.append(search.bodies))
    compile_sources(replace(request.clip, recording=recording), request.background, request.config)
    assert [body.name for bodies in done for body in bodies] == ["human"] * searches


@pytest.mark.parametrize(("words", "searches"), [((), 1), (("actor=anna.yaml",), 0)])
def test_a_search_is_compiled_while_actors_are_made(monkeypatch, words, searches):
    done = []
    monkeypatch.setattr(passes, "compile_sources", lambda *given: done.append(given))
    monkeypatch.setattr(passes, "kept_or_made", lambda *given: Actors((DOG,)))
    run = tiny_run(*words)
    assert ACTORS.make(run).bodies == (DOG,)
    assert done == [(run.clip, run.background, run.config)] * searches


def raising(error):
    def raises(*_):
        raise error

    return raises


def test_wrong_input_is_told_by_whoever_needs_it_and_a_fault_of_the_thread_is_not_hidden(monkeypatch):
    monkeypatch.setattr(passes, "kept_or_made", lambda *given: Actors((DOG,)))
    monkeypatch.setattr(passes, "compile_sources", raising(InputError("no such pose file")))
    assert ACTORS.make(tiny_run()).bodies == (DOG,)
    monkeypatch.setattr(passes, "compile_sources", raising(TypeError("a fault")))
    with pytest.raises(TypeError, match="a fault"):
        ACTORS.make(tiny_run())
    monkeypatch.setattr(passes, "kept_or_made", raising(InputError("no masks")))
    with pytest.raises(InputError, match="no masks"):
        ACTORS.make(tiny_run())
