"""When actors are made again, and which hold then."""

from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest
from run_cases import DOG, pose_request, tiny_clip, tiny_run

from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.model.shape import ShapeModel
from sogjax.run import passes, remake_actors, run
from sogjax.run.actors import ActorRequest, Actors
from sogjax.run.background import Background
from sogjax.run.initial_pose import InitialPose
from sogjax.run.relearn_background import RelearntBackground
from sogjax.run.remake_actors import RemadeActors, may_gain
from sogjax.run.setup import Setup
from sogjax.scene.background import BackgroundImage

SURE, DOUBTFUL = Actors((DOG,), doubts=("",)), Actors((DOG,), doubts=("too little is seen",))
UNLIKE = Actors((DOG,), doubts=("",), unlike=("a paw was not found",))
UNSUITED = replace(DOUBTFUL, overlap=0.7)
BEGUN = InitialPose(3, np.zeros(DOG.skeleton.num_dofs, np.float32), "example frames")
NOTHING = Background((BackgroundImage.nothing(4, 4),))
FRAME = ExamplePose("frame_3", None, {}, {}, None, 3)
PICTURE = ExamplePose("sit", None, {"cam0": Path("a.jpg")}, {"cam0": Path("a.mask.png")}, None)


def of_size(factor):
    """The dog, so many times as large."""
    model = ShapeModel.from_body(DOG)
    return model.shaped(jnp.zeros(model.num_shape_params).at[0].set(np.log(factor)))


def request_of(*examples, files=None):
    clip = tiny_clip()
    shown = replace(clip, recording=replace(clip.recording, example_poses=examples))
    return ActorRequest(shown, lambda: Background(None), files, body="dog")


@pytest.mark.parametrize(
    ("request_", "first", "expected"),
    [
        (request_of(), DOUBTFUL, True),
        (request_of(), UNLIKE, True),
        (request_of(), SURE, False),
        (request_of(), Actors((DOG, DOG), doubts=("", "")), True),
        (request_of(), Actors((DOG, DOG)), False),  # they are given
        (request_of(FRAME), DOUBTFUL, True),
        (request_of(PICTURE), DOUBTFUL, False),  # its mask is given
        (request_of(files=[Path("dog.yaml")]), DOUBTFUL, False),
    ],
)
def test_doubtful_or_several_actors_gain_where_a_background_tells_their_masks(request_, first, expected):
    assert may_gain(request_, first) == expected


def raised(value):
    """The value, unless it is an error."""
    if isinstance(value, InputError):
        raise value
    return value


def remade(monkeypatch, made, begin=BEGUN, first=DOUBTFUL):
    """What comes of actors that are made as `made`, or that error; what is reported, and whose pose is asked for."""
    reported, asked, begun = [], [], []

    def new(request, report):
        asked.append(request.background())
        report([raised(made)])
        return made

    monkeypatch.setattr(remake_actors, "new_actors", new)
    monkeypatch.setattr(
        remake_actors, "find_initial_pose", lambda request, _: begun.append(request.actors) or raised(begin)
    )
    found = remake_actors.remake_actors(request_of(), first, NOTHING, pose_request(), (), reported.extend)
    assert asked[0] is NOTHING
    return found, reported, begun


@pytest.mark.parametrize("made", [SURE, UNLIKE, DOUBTFUL, replace(DOUBTFUL, bodies=(of_size(0.9),))])
def test_tracking_begins_anew_with_actors_that_are_no_more_doubtful(monkeypatch, made):
    found, reported, begun = remade(monkeypatch, made)
    assert found.actors is begun[0] is reported[0] is made
    assert found.initial_pose is BEGUN


@pytest.mark.parametrize(
    ("made", "begin"),
    [
        (Actors((DOG, DOG), doubts=("one", "two")), BEGUN),
        (UNSUITED, BEGUN),
        (replace(DOUBTFUL, bodies=(of_size(0.7),)), BEGUN),
        (replace(SURE, bodies=(of_size(1.4),)), BEGUN),
        (InputError("nobody is seen"), BEGUN),
        (SURE, InputError("nothing like dog is seen")),
    ],
)
def test_the_first_actors_hold_where_others_are_worse_or_none(monkeypatch, made, begin):
    found, reported, _ = remade(monkeypatch, made, begin)
    assert found.actors is found.initial_pose is None
    assert not reported


def test_of_two_that_hardly_suit_the_new_ones_are_taken_unless_they_suit_less(monkeypatch):
    first = replace(DOUBTFUL, overlap=0.72)
    assert remade(monkeypatch, UNSUITED, first=first)[0].actors is UNSUITED
    assert remade(monkeypatch, replace(UNSUITED, overlap=0.6), first=first)[0].actors is None


def of_sizes(*factors):
    """Actors of which nothing is doubtful but the sizes."""
    return Actors(tuple(map(of_size, factors)), doubts=("",) * len(factors))


@pytest.mark.parametrize(
    ("first", "made", "taken"),
    [
        ((1.2,), (0.8,), False),
        ((0.7,), (1.0,), True),  # the first one was wrong
        ((1.0, 0.8), (0.8, 1.0), True),  # who is first is chance
        ((1.0, 0.8), (0.6, 1.0), False),
    ],
)
def test_nobody_becomes_much_shorter_or_taller(monkeypatch, first, made, taken):
    found, _, _ = remade(monkeypatch, of_sizes(*made), first=of_sizes(*first))
    assert (found.actors is not None) == taken


@pytest.mark.parametrize("record", [RemadeActors(), RemadeActors(UNLIKE, BEGUN), RemadeActors(UNSUITED, BEGUN)])
def test_what_was_made_again_is_kept(tmp_path, record):
    assert RemadeActors.load(tmp_path) is None
    record.save(tmp_path)
    kept = RemadeActors.load(tmp_path)
    (tmp_path / remake_actors.FOLDER / remake_actors.LAST).unlink()
    assert RemadeActors.load(tmp_path) is None  # it was stopped before all was kept
    assert (kept.actors is None) == (record.actors is None)
    if record.actors is not None:
        said = lambda actors: (actors.doubts, actors.unlike, actors.overlap)
        assert said(kept.actors) == said(record.actors)
        assert (kept.initial_pose.frame, kept.initial_pose.source) == (BEGUN.frame, BEGUN.source)


def test_a_run_goes_on_with_what_was_made_again(monkeypatch):
    made = []
    new_setup = lambda clip, background, bodies, *_: made.append((Setup.__new__(Setup), bodies)) or made[-1][0]
    monkeypatch.setattr(run, "tracking_setup", new_setup)
    other = replace(SURE, bodies=(replace(DOG, name="other"),))
    begun = replace(BEGUN, frame=0)
    going = tiny_run(actors=DOUBTFUL, initial_pose=begun)
    assert going.setup is going.first_setup
    going.records["remade"] = RemadeActors()
    assert going.actors is DOUBTFUL
    assert going.initial_pose is begun
    going.records["remade"] = RemadeActors(other, BEGUN)
    assert going.actors is other
    assert going.initial_pose is BEGUN
    assert going.setup is going.first_setup is made[-1][0]
    assert [bodies for _, bodies in made] == [DOUBTFUL.bodies, other.bodies]


def test_actors_are_made_again_once_more_of_the_background_is_known():
    wanted = next(each for each in passes.PASSES if each.name == "remade").wanted
    going = tiny_run("actor=null", actors=DOUBTFUL)
    assert not wanted(going)
    going.records["relearnt"] = RelearntBackground(None)
    assert not wanted(going)
    going.records["relearnt"] = RelearntBackground(NOTHING, NOTHING)
    assert wanted(going)
    going.pose_sources = (lambda request: BEGUN,)
    assert not wanted(going)


def test_what_is_known_is_learnt_again_or_was_known_before():
    camera = BackgroundImage.nothing(4, 2)
    left, right = np.zeros((2, 2, 4), bool)
    left[:, :2], right[:, 1:] = True, True
    before = replace(camera, known=left, picture=np.full_like(camera.picture, 10))
    again = replace(camera, known=right, picture=np.full_like(camera.picture, 20))
    (whole,) = RelearntBackground(Background((again,)), Background((before,))).whole.required()
    assert whole.known.all()
    assert whole.picture[0, :, 0].tolist() == [10, 20, 20, 20]
    assert RelearntBackground(None).whole is None
