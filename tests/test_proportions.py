"""Bones that are odd beside an actor's others, in its report and in the verdict."""

from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from motion_cases import walking_motion

from sogjax.model.shape import ShapeModel
from sogjax.quality.proportions import odd_bones, odd_sentence
from sogjax.quality.verdict import verdicts


def scaled(body, **factors):
    """The body with bones that are so many times as long, by the name of a shape group."""
    model = ShapeModel.from_body(body)
    lengths = {name: factors.pop(name.removesuffix("_length"), 1.0) for name in model.names}
    assert not factors
    return model.shaped(jnp.asarray(np.log([*lengths.values()]), jnp.float32))


def test_legs_a_third_too_long_are_odd_and_a_tall_body_is_not():
    body = shipped("human")
    assert odd_bones(scaled(body, whole_body=1.3)) == {}
    assert odd_bones(scaled(body, thigh=1.1, shank=1.1, upper_arm=0.93, upper_back=0.95)) == {}
    odd = odd_bones(scaled(body, whole_body=0.9, thigh=4 / 3, shank=4 / 3))
    assert odd == {"thigh": pytest.approx(4 / 3, rel=0.01), "shank": pytest.approx(4 / 3, rel=0.01)}


@pytest.mark.parametrize(("size", "said"), [(0.57, "only a part of somebody"), (1.4, "more than one person")])
def test_a_human_of_half_the_size_or_a_giant_is_doubted(size, said):
    sentence = odd_sentence(scaled(shipped("human"), whole_body=size))
    assert sentence is not None
    assert f"{size:.0%} as long as an adult's" in sentence
    assert said in sentence


def test_a_child_of_seven_a_tall_man_and_a_small_dog_are_not():
    assert odd_sentence(scaled(shipped("human"), whole_body=0.72)) is None
    assert odd_sentence(scaled(shipped("human"), whole_body=1.15)) is None
    assert odd_sentence(scaled(shipped("dog"), whole_body=0.5)) is None


def test_one_side_is_named():
    body = shipped("human")
    lengths = np.asarray(body.skeleton.offsets).copy()
    knee = next(k for k, name in enumerate(body.skeleton.names) if name.startswith("left_knee"))
    lengths[knee] *= 0.7
    shorter = eqx.tree_at(lambda b: b.skeleton.offsets, body, jnp.asarray(lengths))
    assert set(odd_bones(shorter)) == {"left thigh"}
    assert "left thigh 30% too short" in str(odd_sentence(shorter))


def test_any_body_is_held_against_the_one_it_was_made_from():
    dog = shipped("dog")
    assert odd_sentence(dog) is None
    longer = scaled(dog, thigh=1.4)
    assert odd_bones(longer, dog) == odd_bones(longer) != {}
    renamed = replace(longer.skeleton, names=tuple(f"own_{name}" for name in dog.skeleton.names))
    assert odd_bones(replace(longer, skeleton=renamed)) == {}, "nothing is known of another skeleton"


def test_a_motion_that_fits_well_does_not_look_right_with_odd_bones():
    motion = walking_motion(num_frames=12)
    motion = replace(motion, explained=np.full(motion.num_frames, 0.7))
    said = odd_sentence(scaled(shipped("human"), thigh=4 / 3, shank=4 / 3))
    assert said is not None
    assert verdicts({"anna": motion}, {"anna": 0.7})["anna"].looks_right
    found = verdicts({"anna": motion}, {"anna": 0.7}, odd={"anna": [said]})["anna"]
    assert not found.looks_right
    assert "thigh 33% too long" in found.sentence
