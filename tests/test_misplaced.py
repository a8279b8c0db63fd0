"""Actors that are followed where they are not: where they are looked for, and that they are found."""

from dataclasses import replace
from inspect import unwrap
from types import SimpleNamespace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import cells_of, draw, in_colors, standing
from rig_cases import ring_rig
from test_both_ways import reader
from walking_dog import DEPTH, judging_tracker, pass_of

from sogjax.model.body import concatenate
from sogjax.model.limbs import limb_names
from sogjax.run import merge
from sogjax.search.combination import trunk_blobs
from sogjax.search.merge_passes import merge_passes
from sogjax.search.misplaced import Misplaced
from sogjax.search.placed_body import means_of
from sogjax.tracking.frame_by_frame import track

HUMAN = shipped("human")
unseen = unwrap(merge.unseen)
FRAMES = 5


@pytest.fixture(scope="module")
def beside_himself():
    """A tracker of two people, the cells of a clip, their true pose, and what is found from one beside himself."""
    anna, ben = in_colors(replace(HUMAN, name="anna")), in_colors(replace(HUMAN, name="ben"), (20.0, 100.0))
    both, rig = concatenate([anna, ben]), ring_rig(5, (160, 120), distance=3.0)
    tracker = judging_tracker(both, rig)
    right = np.concatenate([standing(anna, 1.0, (0.4, 0.0)), standing(ben, 1.0, (-0.4, 0.0))]).astype(np.float32)
    cells = [cells_of(rig, draw(both, jnp.asarray(right), rig), DEPTH)] * FRAMES
    wrong = right.copy()
    wrong[1] += 1.2
    frames = [*track(tracker, jnp.asarray(wrong), cells)]
    explained = np.stack([np.asarray(frame.result.limbs.explained) for frame in frames])
    return tracker, (anna, ben), cells, right, pass_of(frames), explained


def off(body, pose, right):
    """Metres by which the blobs of each actor's trunk are apart, on average."""
    apart = np.linalg.norm(means_of(body, pose[None])[0] - means_of(body, right[None])[0], axis=-1)
    return np.array([apart[trunk_blobs(body) & (body.blob_actors == k)].mean() for k in (0, 1)])


@pytest.mark.slow
def test_an_actor_who_is_not_where_he_is_followed_is_found_beside_the_other(beside_himself):
    tracker, bodies, cells, right, passed, explained = beside_himself
    assert off(tracker.body, passed.poses[2], right)[0] > 0.5
    assert explained[:, 0].max() < 0.5 * explained[:, 1].min()
    misplaced = Misplaced(tracker, bodies, "z", explained, 0.6 * explained[:, 1].min(keepdims=True).repeat(2))
    found = merge_passes(tracker, passed, reader(cells), misplaced=misplaced)
    assert found.parts["anna/whole body"] == {*range(FRAMES)}
    assert max(off(tracker.body, found.frames[row].pose, right)[0] for row in range(FRAMES)) < 0.05


def looked_at(explained, body=HUMAN):
    """The places at which an actor of whom less than a half has to be explained is looked for."""
    misplaced = Misplaced.__new__(Misplaced)
    misplaced.bodies, misplaced.explained, misplaced.least = (body,), np.array(explained)[:, None], np.array([0.5])
    return misplaced


def test_an_actor_is_looked_for_where_little_of_him_is_explained():
    assert [*looked_at([0.6] * 20).places()] == []
    assert [*looked_at([0.6] * 10 + [0.1] * 2 + [0.6] * 8).places()] == []  # too short to be more than a blur
    assert [*looked_at([0.6] * 5 + [0.1] * 10 + [0.6] * 5).places()] == [(10, 0), (7, 0), (13, 0)]


def test_he_is_not_looked_for_where_he_was_found_meanwhile():
    misplaced = looked_at([0.1] * 10 + [0.6] * 5 + [0.1] * 10)
    places = misplaced.places()
    assert next(places) == (5, 0)
    misplaced.explained[:10] = 0.7
    assert [*places] == [(20, 0), (17, 0), (23, 0)]


def test_who_is_not_seen_is_not_misplaced():
    """Out of all views nothing is explained; behind things little may be, of what is not hidden."""
    both = concatenate([replace(HUMAN, name="anna"), replace(HUMAN, name="ben")])
    of_ben = np.array([name.startswith("ben/") for name in limb_names(both)])
    hidden = np.zeros((3, len(of_ben)))
    hidden[1, of_ben] = 0.95
    hidden[2, np.flatnonzero(of_ben)[1:]] = 0.95  # one limb is in view
    table = SimpleNamespace(explained=np.array([[0.0, 0.1]] * 3), limb_hidden=hidden)
    setup = SimpleNamespace(tracker=SimpleNamespace(body=both))
    np.testing.assert_array_equal(unseen(setup, table), [[True, False], [True, True], [True, False]])
