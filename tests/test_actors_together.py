"""What the bodies of others leave of the masks of all people."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import moved, standing
from rig_cases import recording_of, ring_rig

from sogjax.actor import make, together
from sogjax.actor.coverage import body_silhouette
from sogjax.actor.make import MadeActor, Making
from sogjax.actor.silhouette_fit import Estimate
from sogjax.actor.silhouettes import PosedPictures
from sogjax.actor.together import People, believed, made_together
from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.model.shape import ShapeModel
from sogjax.search.placed_body import turned

RIG = ring_rig(4, (160, 120), distance=3.5)
DOG = shipped("dog")
MODEL = ShapeModel.from_body(DOG)
SIZE = (120, 160)
CAMERAS = range(len(RIG.names))
NONE = PosedPictures("a", {}, {})


def silhouette(pose, camera):
    return body_silhouette(DOG, jnp.asarray(pose), RIG.camera(RIG.names[camera]), SIZE)


def made(pose):
    zeros = jnp.zeros(MODEL.num_shape_params)
    estimate = Estimate(jnp.asarray(pose)[None], zeros, jnp.zeros((1, len(pose))), zeros)
    return MadeActor(DOG, DOG, DOG, {"a": jnp.asarray(pose)}, {"a": 0}, (), RIG.cameras, MODEL, estimate)


def making_of(examples):
    recording = replace(recording_of(RIG, 20), example_poses=tuple(examples))
    return Making.of(recording, DOG, None, "lab", True, best=None, report=print)


@pytest.fixture(scope="module")
def poses():
    first = standing(DOG, 1.2)
    return [first, moved(DOG, first, {"root_x": 0.7, "root_y": 0.3})]


def all_people(poses):
    masks = {k: silhouette(poses[0], k) | silhouette(poses[1], k) for k in CAMERAS}
    images = {k: np.zeros((*SIZE, 3), np.uint8) for k in CAMERAS}
    return PosedPictures("a", images, masks)


def test_masks_say_nothing_where_somebody_else_is(poses):
    left = People(tuple(map(made, poses)), {"a": all_people(poses)}).left_by_others(0, NONE, poses)
    assert left.masks.keys() == left.untold.keys() == left.images.keys()
    assert len(left.masks) >= 2
    for k in left.masks:
        own, other = silhouette(poses[0], k), silhouette(poses[1], k)
        assert not (left.masks[k] & other).any()
        assert left.untold[k][other].all()
        assert not (left.masks[k] & left.untold[k]).any()
        assert not (left.masks[k] & ~own).any()
        assert left.masks[k].sum() > 0.3 * own.sum()


def test_masks_of_somebody_who_is_seen_only_behind_another_stay_his_own(poses):
    same = [poses[0], poses[0]]
    assert People(tuple(map(made, same)), {"a": all_people(same)}).left_by_others(0, NONE, same) is NONE


@pytest.mark.parametrize(("alone", "again"), [(0.0, 0.2), (0.2, 0.0)])
def test_of_the_fit_alone_and_that_beside_others_the_better_one_is_kept(poses, monkeypatch, alone, again):
    """Metres by which each is off."""
    off = lambda by: made(moved(DOG, poses[0], {"root_x": by}))
    found = off(again)
    monkeypatch.setattr(together, "fit_edges", lambda *_: found.estimate)
    monkeypatch.setattr(Making, "finished", lambda *_: found)
    actors = [replace(off(alone), pictures=(all_people(poses),)), made(poses[1])]
    kept = People(tuple(actors), {"a": all_people(poses)}).fitted_again(
        0, making_of(()), [{"a": pose} for pose in poses]
    )
    assert kept is (found if again < alone else actors[0])


def test_an_example_pose_is_believed_that_goes_with_the_others(poses):
    """Of three moments the second one fits a little better back to front."""
    frames = {name: ExamplePose(name, None, {}, {}, None, frame) for name, frame in (("a", 0), ("b", 5), ("c", 10))}
    making = making_of(frames.values())
    front, back = (np.asarray(turned(DOG, jnp.asarray(poses[0]), heading, "z")) for heading in (0.0, np.pi))
    ways = {name: [(front, 0.1), (back, 0.08 if name == "b" else 0.12)] for name in frames}
    found = believed(making, DOG, ways, 0)
    assert all(np.array_equal(found[name], front) for name in frames)
    assert np.array_equal(believed(making, DOG, {"b": ways["b"]}, 0)["b"], back)
    assert np.array_equal(believed(making, DOG, {"b": [(front, 0.1), (back, 0.09)]}, 0)["b"], front)  # hardly better
    assert np.array_equal(believed(making, DOG, {"b": [(front, 0.1), (back, 0.09)]}, 1)["b"], back)
    assert np.array_equal(believed(making, DOG, {"b": [(front, 1.4), (back, 1.8)]}, 0)["b"], front)


def test_an_actor_is_not_searched_in_the_masks_of_everybody(poses):
    same = [{"a": poses[0]}, {"a": poses[0]}]
    people = People(tuple(map(made, (poses[0], poses[0]))), {"a": all_people([poses[0], poses[0]])})
    (found, _), *others = people.ways(0, people.shown["a"], same, 0, up="z")
    assert found is poses[0]
    assert not others


def test_a_pose_suits_that_masks_and_colours_agree_with(poses):
    suits = lambda part: replace(made(poses[0]), pictures=(all_people(poses),), explained={"a": part}).suitability("a")
    assert 0.0 < suits(0.4) == pytest.approx(0.5 * suits(0.8))


def test_actors_without_a_common_pose_stay_as_they_were_made(poses):
    people = [made(pose) for pose in poses]
    assert made_together([], people, {}) == people


def test_everybody_is_the_subject_of_pictures_of_everybody():
    alone = {"left": np.ones((2, 2), bool)}
    example = ExamplePose("frame_3", "anna", {}, {}, None, 3, alone, alone)
    of_all = example.of_everybody(["left", "right"])
    assert of_all.within is None
    assert of_all.others is not None
    assert of_all.others.keys() == {"left", "right"}
    assert not any(mask.any() for mask in of_all.others.values())


@pytest.mark.parametrize("unchosen", [True, False])
def test_a_pose_that_was_not_found_in_pictures_that_nobody_chose_may_be_of_several_people(monkeypatch, unchosen):
    monkeypatch.setattr(make, "agreement", lambda *_: 0.3)
    poses = jnp.zeros((1, DOG.skeleton.num_dofs))
    estimate = Estimate(poses, jnp.zeros(2), poses, jnp.zeros(2))
    with pytest.raises(InputError, match=r"pose of the example 'a' was not found: .* only 0\.30") as refused:
        make._check_fit(recording_of(RIG, 3), DOG, estimate, [NONE], RIG.cameras, unchosen)
    assert ("if several people are seen, say how many with actors=2" in str(refused.value)) == unchosen
