"""Limbs of example poses, searched by the edges of masks, beside others."""

from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import moved, standing
from rig_cases import ring_rig

from sogjax.actor import body_silhouettes, limb_silhouettes
from sogjax.actor.body_silhouettes import WaysRound, upright_all_round
from sogjax.actor.coverage import body_silhouette
from sogjax.actor.limb_silhouettes import Everybody, _different, _SeenUnit, with_limbs_found
from sogjax.actor.silhouette_fit import COARSE_CELLS, silhouettes_of
from sogjax.actor.silhouettes import PosedPictures
from sogjax.model.body import concatenate
from sogjax.model.limbs import limb_blobs
from sogjax.model.solid import Solid
from sogjax.search.placed_body import heading_dof

pytestmark = pytest.mark.slow

RIG = ring_rig(4, (320, 240), distance=3.5)
HUMAN = shipped("human")


def least(cost):
    """The first way and the one that costs least."""
    return [0, int(np.argmin(cost))]


def hands_off(pose, truth):
    joints = [HUMAN.landmarks.names.index(name) for name in ("left_wrist", "right_wrist")]
    places = [np.asarray(HUMAN.posed_landmarks(jnp.asarray(each)))[joints] for each in (pose, truth)]
    return np.linalg.norm(places[0] - places[1], axis=1)


def masks_of(pose):
    size = RIG.image_size(RIG.names[0])[::-1]
    return {k: body_silhouette(HUMAN, jnp.asarray(pose), RIG.camera(name), size) for k, name in enumerate(RIG.names)}


def cells_of_masks(masks):
    pictures = PosedPictures("a", {}, masks)
    return jax.tree.map(lambda leaf: leaf[0], silhouettes_of([pictures], RIG.cameras, COARSE_CELLS))


def raised():
    """An arm held up sideways, and the rest pose."""
    start = standing(HUMAN, 1.0)
    return moved(HUMAN, start, {"left_shoulder_raise": -1.2}), start


def test_an_arm_is_found_where_the_masks_show_it():
    truth, start = raised()
    masks = masks_of(truth)
    assert hands_off(start, truth).max() > 0.4
    found = with_limbs_found(Everybody.of([HUMAN]), 0, [start], cells_of_masks(masks), 0)
    assert hands_off(found, truth).max() < 0.15  # half a hand: the cells are as wide
    legs = [k for k, name in enumerate(HUMAN.skeleton.dof_names) if "knee" in name or "hip" in name]
    np.testing.assert_array_equal(found[legs], start[legs])


def bent():
    """A body whose front and back are not alike."""
    return moved(
        HUMAN, standing(HUMAN, 1.0), {"left_shoulder_swing": 1.3, "right_shoulder_swing": 1.3, "left_knee": 0.6}
    )


def ways_of(truth, pose, starts):
    """Ways to see the masks of the truth, from a pose and other starts."""
    return WaysRound(Everybody.of([HUMAN]), 0, "z").found([pose], cells_of_masks(masks_of(truth)), 0, starts)


def nose_off(pose, truth):
    nose = HUMAN.landmarks.names.index("nose")
    places = [np.asarray(HUMAN.posed_landmarks(jnp.asarray(each)))[nose] for each in (pose, truth)]
    return np.linalg.norm(places[0] - places[1])


def test_a_pose_that_covers_the_masks_fits_better_than_turned_round(monkeypatch):
    truth = bent()
    assert len(ways_of(truth, truth, upright_all_round(HUMAN, "z"))) == 2  # the pose, and where it is climbed to
    monkeypatch.setattr(body_silhouettes, "HOPELESS", 10.0)
    (found, miss), *others = ways_of(truth, truth, upright_all_round(HUMAN, "z"))
    turned, turned_miss = others[-1]
    assert nose_off(found, truth) < 0.05 < nose_off(turned, truth)
    assert miss < 0.9 * turned_miss


def test_a_trunk_that_faces_sideways_is_found_where_the_masks_show_it():
    truth = bent()
    heading, per_radian = heading_dof(HUMAN, "z")
    aside = np.array(truth)
    aside[heading] += 0.5 * np.pi / per_radian
    assert nose_off(aside, truth) > 0.1
    ways = ways_of(truth, aside, upright_all_round(HUMAN, "z"))
    best, _ = min(ways, key=lambda way: way[1])
    assert nose_off(best, truth) < 0.05


def test_a_pose_is_found_that_is_known_from_another_moment():
    truth = moved(HUMAN, bent(), {"root_pitch": 1.2})
    start = standing(HUMAN, 1.0)
    ways = ways_of(truth, start, [moved(HUMAN, truth, {"root_x": 0.6, "root_y": -0.4, "left_knee": 0.2})])
    best, _ = min(ways, key=lambda way: way[1])
    assert nose_off(start, truth) > 0.3
    assert nose_off(best, truth) < 0.05
    assert hands_off(best, truth).max() < 0.1


def test_limbs_that_cover_the_masks_stay():
    _, start = raised()
    masks = masks_of(start)
    found = with_limbs_found(Everybody.of([HUMAN]), 0, [start], cells_of_masks(masks), 0)
    assert hands_off(found, start).max() < 0.05


def test_a_limb_in_somebody_elses_trunk_is_impossible_but_in_his_arm_not():
    start = standing(HUMAN, 1.0)
    beside = moved(HUMAN, start, {"root_y": 0.18})
    apart = moved(HUMAN, start, {"root_y": 3.0})
    everybody, nothing = Everybody.of([HUMAN, HUMAN]), np.zeros(0, int)
    own = np.arange(HUMAN.num_blobs)
    inside, free = (everybody.impossibility(0, start[None], [start, other], own, nothing) for other in (beside, apart))
    assert inside > 0.5
    assert free == 0.0
    assert everybody.impossibility(0, start[None], [start, beside], own, own) == 0.0  # wherever its own blobs are
    assert everybody.impossibility(0, start[None], [start, beside], nothing, nothing) == 0.0  # none that is moved
    arm = limb_blobs(HUMAN)[0]
    assert 0.0 < everybody.impossibility(0, start[None], [start, beside], np.flatnonzero(arm), nothing) <= inside
    whole = concatenate([HUMAN, HUMAN])
    np.testing.assert_array_equal(everybody.blobs(1), own + HUMAN.num_blobs)
    means = whole.posed_blobs(jnp.asarray(np.concatenate([start, beside]))).means
    assert Solid.of(whole).regardless_of(np.arange(whole.num_blobs)).impossibility(means) == 0.0


@pytest.mark.parametrize("choose", [lambda _: least, lambda angles: lambda cost: _different(angles, cost)])
@pytest.mark.parametrize("possible", [0.0, 0.1, 0.9])
def test_ways_that_are_not_checked_would_not_be_chosen(monkeypatch, choose, possible):
    rng = np.random.default_rng(7)
    for count in (1, 16, 129, 512):
        mismatches = rng.gamma(2.0, 0.1, count)
        impossible = np.where(rng.random(count) < possible, 0.0, rng.random(count))
        monkeypatch.setattr(limb_silhouettes, "_from_rest", lambda _, ways: np.zeros(len(ways)))
        monkeypatch.setattr(limb_silhouettes, "_mismatches", lambda *_, known=mismatches: known)
        checked = lambda _, ways, *__, known=impossible: known[ways[:, 0].astype(int)]
        seen = object.__new__(_SeenUnit)
        parts = {"number": 0, "poses": [], "silhouettes": None, "unit": SimpleNamespace(all_blobs=np.arange(3))}
        parts["everybody"] = SimpleNamespace(bodies=[HUMAN], impossibility=checked)
        for name, part in parts.items():
            object.__setattr__(seen, name, part)
        chosen = choose(rng.normal(0.0, 0.3, (count, 2)))
        ways, fills = np.arange(count, dtype=float)[:, None], jnp.zeros((count, 1, 1))
        kept, costs = seen._chosen(ways, fills[0], fills, np.arange(1), chosen)
        everything = mismatches * (1.0 + impossible)
        assert kept == chosen(everything)
        np.testing.assert_allclose(costs[kept], everything[kept])
