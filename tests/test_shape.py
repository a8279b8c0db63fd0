"""Shape parameters: what scales what (Section 5.2)."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body, reference_points, shipped

from sogjax.model.shape import WHOLE_SPREAD, ShapeModel

BODIES = {"human": shipped("human"), "dog": shipped("dog"), "random": random_body(0)}

shaped_by = eqx.filter_jit(lambda model, params: model.shaped(params))


def params(model, values):
    array = np.zeros(model.num_shape_params, np.float32)
    for index, value in values.items():
        array[index] = value
    return jnp.asarray(array)


def lengths(body):
    """Everything that a shape parameter may scale, by field of the groups, one positive number an item."""
    norm = lambda offsets: np.linalg.norm(np.asarray(offsets, float), axis=1)
    return {
        "joint_offsets": (body.skeleton.names, norm(body.skeleton.offsets)),
        "blob_offsets": (body.blobs.names, norm(body.blobs.offsets)),
        "blob_sigmas": (body.blobs.names, np.asarray(body.blob_sigmas, float)),
        "landmark_offsets": (body.landmarks.names, norm(body.landmarks.offsets)),
    }


@pytest.mark.parametrize("name", BODIES)
def test_all_zero_is_the_body_itself(name):
    model = ShapeModel.from_body(BODIES[name])
    assert model.num_shape_params == 1 + len(BODIES[name].shape_groups)
    assert eqx.tree_equal(shaped_by(model, params(model, {})), BODIES[name])


@pytest.mark.parametrize("name", BODIES)
def test_the_first_parameter_scales_the_whole_body(name):
    """A body scaled by a factor is the same in any pose, but larger: blobs at the scaled places."""
    body = BODIES[name]
    model = ShapeModel.from_body(body)
    larger = shaped_by(model, params(model, {0: np.log(1.1)}))
    pose = np.array(body.poses["rest"], float)
    slides = ~np.asarray(body.skeleton.revolute)
    pose[np.abs(np.asarray(body.skeleton.parameter_transform)[slides]).sum(axis=0) > 0.0] = 0.0
    for part in ("blobs", "landmarks"):
        before = reference_points(body.skeleton, getattr(body, part), pose)
        after = reference_points(larger.skeleton, getattr(larger, part), pose)
        np.testing.assert_allclose(after, 1.1 * before, atol=1e-5)
    np.testing.assert_allclose(larger.blob_sigmas, 1.1 * np.asarray(body.blob_sigmas), rtol=1e-5)


@pytest.mark.parametrize("name", BODIES)
def test_a_group_scales_its_members_and_nothing_else(name):
    body = BODIES[name]
    model, before = ShapeModel.from_body(body), lengths(body)
    for index, group in enumerate(body.shape_groups, 1):
        after = lengths(shaped_by(model, params(model, {index: np.log(1.3)})))
        for field, (names, values) in before.items():
            members = np.isin(names, getattr(group, field))
            np.testing.assert_allclose(after[field][1], np.where(members, 1.3, 1.0) * values, rtol=1e-4, atol=1e-7)


def test_factors_of_several_groups_multiply():
    body = BODIES["human"]
    model = ShapeModel.from_body(body)
    together = shaped_by(model, params(model, {0: 0.2, 1: -0.1, 3: 0.4}))
    apart = body
    for index, value in {0: 0.2, 1: -0.1, 3: 0.4}.items():
        apart = shaped_by(ShapeModel.from_body(apart), params(model, {index: value}))
    for field, (_, values) in lengths(apart).items():
        np.testing.assert_allclose(lengths(together)[field][1], values, rtol=1e-5, atol=1e-7)
    np.testing.assert_array_equal(together.skeleton.axes, body.skeleton.axes)
    np.testing.assert_array_equal(together.blob_colors, body.blob_colors)


@pytest.mark.parametrize("name", BODIES)
def test_a_size_as_nobody_has_it_is_named_and_counts_for_far_more(name):
    model = ShapeModel.from_body(BODIES[name])
    last = model.num_shape_params - 1
    of = lambda times: params(model, {last: times * float(model.spread[last])})
    assert model.unusual_names(of(1.0)) == []
    assert model.unusual_names(of(-2.0)) == [model.names[last]]
    assert float(model.penalty(of(1.0))) == pytest.approx(1.0)
    assert float(model.penalty(of(2.0))) == pytest.approx(4.0 + 100.0 * 0.25)
    whole = params(model, {0: 2.0 * WHOLE_SPREAD})  # no size of a whole body is one that nobody has
    assert float(model.penalty(whole)) == pytest.approx(4.0)


def test_lengths_of_bones_are_known_best_then_those_of_what_a_skeleton_ends_with():
    for name, ends in (("human", {"head_length", "hand_length", "foot_length"}), ("dog", {"head_length"})):
        model = ShapeModel.from_body(BODIES[name])
        spread = dict(zip(model.names, np.asarray(model.spread, float).round(3).tolist(), strict=True))
        assert ends <= {group for group, value in spread.items() if value == 0.1}
        lengths = {group.name for group in BODIES[name].shape_groups if group.joint_offsets}
        assert {spread[group] for group in lengths} == {0.05}
    assert spread["chest_place"] == 0.2
