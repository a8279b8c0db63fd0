"""Limbs in doubt: what the pictures say of one that is elsewhere, and of one in its place."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import BACKGROUND, cells_of, draw, in_colors, make_tracker, moved, standing
from motion_cases import walking_motion
from rig_cases import ring_rig
from scipy.special import expit
from slow_values import fast_and_slow

from sogjax.energy.posed import Posed
from sogjax.energy.views import windows_around
from sogjax.model.body import concatenate
from sogjax.model.camera import project
from sogjax.model.limbs import joint_limbs, limb_blobs, limb_names, limb_slices
from sogjax.model.sog import Sog
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.limb_confidence import (
    LEAST_RIVAL,
    MOST_RIVAL,
    LimbMeasures,
    beside_rivals,
    error_probability,
    limb_confidence,
)
from sogjax.quality.limb_evidence import (
    CLEARLY,
    TOUCHING,
    BlobEvidence,
    LimbBlobs,
    blob_evidence,
    own_or_hidden,
    visible_parts,
)
from sogjax.quality.limb_warnings import doubtful_limbs, in_doubt
from sogjax.scene.background import BackgroundCells
from sogjax.scene.foreground import LARGEST, BackgroundModel, own_density, subject_colors, subject_density
from sogjax.tracking.frame import FrameInput
from sogjax.tracking.frame_by_frame import track

DEPTH = 6
LIMB, BESIDE = "left front leg", "right front leg"
ELSEWHERE = {"left_front_swing": 0.9, "left_elbow": -0.4}


def judging(body, rig, with_background):
    """A tracker of a small scene that judges limbs."""
    tracker = make_tracker(body, rig, DEPTH)
    table = subject_colors(np.asarray(body.blob_colors), np.asarray(body.blob_sigmas) ** 2)
    shape = cells_of(rig, draw(body, standing(body, 1.1), rig), DEPTH).shape
    empty = BackgroundCells(
        np.full(shape, BACKGROUND, np.uint8), np.full(shape[:3], 0.02, np.float32), np.ones(shape[:3], bool)
    )
    reader = replace(
        tracker.reader,
        subject=jnp.asarray(table, jnp.float32),
        background=BackgroundModel.from_background(empty) if with_background else None,
    )
    return replace(tracker, reader=reader, limbs=LimbBlobs.from_body(body), pairs="sparse")


@pytest.fixture(scope="module", params=[True, False], ids=["background", "none"])
def dog(request):
    body = in_colors(shipped("dog"))
    rig = ring_rig(5, (160, 120), distance=1.6)
    pose = standing(body, 1.1)
    return judging(body, rig, request.param), pose, cells_of(rig, draw(body, pose, rig), DEPTH)


@eqx.filter_jit
def evidence_of(tracker, pose, cells, present=None):
    windows = None
    if tracker.reader.background is not None:
        odds = tracker.reader.odds(cells.astype(jnp.float32) / 255.0)
        windows = tracker.reader.windows(odds, tracker.cameras, tracker.boxes(tracker.start(pose)))
    posed, reader = Posed.from_pose(tracker.body, pose), tracker.reader
    return blob_evidence(
        tracker.limbs, posed, tracker.cameras, windows, cells, reader.cell_sizes, reader.subject, present
    )


def judged(tracker, pose, cells, baseline):
    evidence = evidence_of(tracker, jnp.asarray(pose), jnp.asarray(cells))
    return limb_confidence(tracker.limbs, evidence, baseline, tracker.reader.background is not None)


@pytest.mark.slow
def test_what_may_be_background_speaks_against_nobody_s_colours(dog):
    tracker, pose, cells = dog
    posed, reader = Posed.from_pose(tracker.body, jnp.asarray(pose)), tracker.reader
    boxes = tracker.boxes(tracker.start(jnp.asarray(pose)))

    def evidence(odds):
        windows = None if odds is None else windows_around(odds, reader.cell_sizes, tracker.cameras, boxes)
        given = windows, jnp.asarray(cells), reader.cell_sizes, reader.subject
        return blob_evidence(tracker.limbs, posed, tracker.cameras, *given)

    everywhere = lambda odds: evidence(jnp.full(cells.shape[:3], odds))
    unknown, perhaps, clearly = evidence(None), everywhere(-CLEARLY), everywhere(-LARGEST)
    assert float(unknown.explained.mean()) > 0.3
    np.testing.assert_array_equal(perhaps.explained, unknown.explained)
    assert (np.asarray(clearly.explained) == 0.0).all()
    assert float(unknown.contradicted.max()) == 0.0 < float(perhaps.contradicted.max())


@pytest.mark.slow
def test_only_a_limb_that_is_elsewhere_is_in_doubt(dog):
    tracker, pose, cells = dog
    names = limb_names(tracker.body)
    before = judged(tracker, pose, cells, jnp.full((2, tracker.body.num_blobs), jnp.nan))
    assert float(before.error_probability.max()) < 0.1
    after = judged(tracker, moved(tracker.body, pose, ELSEWHERE), cells, before.baseline)
    assert float(after.error_probability[names.index(LIMB)]) > 0.5
    beside = float(after.error_probability[names.index(BESIDE)])
    others = np.delete(np.asarray(after.error_probability), [names.index(LIMB), names.index(BESIDE)])
    assert others.max() < 0.3
    # without a background: what the moved leg explained in front of this one, nothing explains any more
    assert beside < (0.3 if tracker.reader.background is not None else 0.5)


@pytest.mark.parametrize("light", fast_and_slow(0.55, 1.15))
def test_a_limb_in_another_light_is_in_doubt_only_elsewhere(dog, light):
    """As a lamp or the shade beside it makes a limb brighter or darker as a whole, the rest as it was."""
    tracker, pose, cells = dog
    body, k = tracker.body, limb_names(tracker.body).index(LIMB)
    colors = np.array(body.blob_colors)
    colors[limb_blobs(body)[k]] *= light
    lit = eqx.tree_at(lambda b: b.blob_colors, body, jnp.asarray(colors, jnp.float32))
    rig = ring_rig(5, (160, 120), distance=1.6)
    shown = cells_of(rig, draw(lit, pose, rig), DEPTH)
    baseline = judged(tracker, pose, cells, jnp.full((2, body.num_blobs), jnp.nan)).baseline
    assert float(judged(tracker, pose, shown, baseline).error_probability[k]) < 0.5
    elsewhere = moved(body, pose, ELSEWHERE)
    assert float(judged(tracker, elsewhere, shown, baseline).error_probability[k]) > 0.5


def test_a_background_of_a_limbs_own_color_does_not_contradict_it():
    """Bare arms before planks of the skin's colour: what looks like the background is the arm as well."""
    body, rig = in_colors(shipped("dog")), ring_rig(5, (160, 120), distance=1.6)
    pose, limb = standing(body, 1.1), limb_blobs(body)[limb_names(body).index(LIMB)]
    colors = np.array(body.blob_colors)
    colors[limb] = np.array(BACKGROUND) / 255.0
    like_the_room = eqx.tree_at(lambda b: b.blob_colors, body, jnp.asarray(colors, jnp.float32))
    shown = jnp.asarray(cells_of(rig, draw(like_the_room, pose, rig), DEPTH))
    of_limb = lambda one: evidence_of(judging(one, rig, True), jnp.asarray(pose), shown).contradicted[limb]
    assert float(of_limb(like_the_room).max()) < 0.1
    assert float(of_limb(body).mean()) > 0.5  # of other colours, it is not there


def test_a_limb_in_doubt_does_not_become_usual(dog):
    tracker, pose, cells = dog
    baseline = judged(tracker, pose, cells, jnp.full((2, tracker.body.num_blobs), jnp.nan)).baseline
    wrong, k = moved(tracker.body, pose, ELSEWHERE), limb_names(tracker.body).index(LIMB)
    doubts = []
    for _ in range(60):
        found = judged(tracker, wrong, cells, baseline)
        baseline = found.baseline
        doubts.append(float(found.error_probability[k]))
    assert doubts[-1] > 0.5 > 0.1 > doubts[0] - doubts[-1]


def test_cameras_without_a_picture_say_nothing(dog):
    tracker, pose, cells = dog
    broken = np.array(cells)
    broken[1] = 255
    present = jnp.asarray([True, False, True, True, True])
    whole, other = (evidence_of(tracker, jnp.asarray(pose), jnp.asarray(c), present) for c in (cells, broken))
    np.testing.assert_allclose(other.own, whole.own, atol=1e-5)


@pytest.mark.slow
def test_the_step_judges(dog):
    tracker, pose, cells = dog
    frames = [cells] * 3
    one_by_one = [frame.result for frame in track(tracker, jnp.asarray(pose), frames)]
    doubts = np.stack([result.limbs.error_probability for result in one_by_one])
    assert doubts.shape == (3, len(limb_names(tracker.body)))
    unjudged = [f.result for f in track(replace(tracker, limbs=None), jnp.asarray(pose), frames)]
    assert unjudged[-1].limbs is None
    np.testing.assert_allclose(unjudged[-1].pose, one_by_one[-1].pose, atol=1e-5)
    state, _ = eqx.filter_jit(tracker.step)(
        tracker.start(pose),
        FrameInput(cells, np.arange(5) != 1),
        next(track(tracker, jnp.asarray(pose), frames)).capacities,
    )
    assert np.isfinite(np.asarray(state.baseline)).all()


def test_what_hides_a_limb_is_no_evidence_against_it():
    """A limb behind the trunk is not seen; one beside it is."""
    body = in_colors(shipped("dog"))
    rig = ring_rig(1, (160, 120), distance=1.6)
    tracker, pose = judging(body, rig, False), standing(body, 1.1)
    cells = cells_of(rig, draw(body, pose, rig), DEPTH)
    seen = np.asarray(evidence_of(tracker, jnp.asarray(pose), jnp.asarray(cells)).seen)
    assert seen.min() < 0.2
    assert seen.max() > 0.8


CROSSED = {"left_front_side": -0.3, "right_front_side": -0.3, "left_front_swing": 0.15}


def test_limbs_that_touch_do_not_contradict_each_other():
    """A leg close behind another is still partly looked at: what is seen there may be the other's."""
    body, rig = in_colors(shipped("dog")), ring_rig(5, (160, 120), distance=1.6)
    tracker, pose = judging(body, rig, True), standing(body, 1.1)
    cells = cells_of(rig, draw(body, pose, rig), DEPTH)
    baseline = judged(tracker, pose, cells, jnp.full((2, body.num_blobs), jnp.nan)).baseline
    crossed = moved(body, pose, CROSSED)
    shown = cells_of(rig, draw(body, crossed, rig), DEPTH)
    assert float(judged(tracker, crossed, shown, baseline).error_probability.max()) < 0.35  # 0.57 by their own colours


def test_colours_are_a_blobs_own_or_those_of_what_hides_it():
    own, hiding = jnp.asarray([-4.0, 2.0, -4.0]), jnp.asarray([3.0, -4.0, -4.0])
    of = lambda visible: np.asarray(own_or_hidden(own, hiding, jnp.asarray(visible)))
    np.testing.assert_allclose(of(1.0), own, atol=1e-5)
    np.testing.assert_allclose(of(0.8), np.log(np.exp(own) + 0.25 * np.exp(hiding)), atol=1e-5)
    for hardly in (0.5, 0.1, 0.0):  # at most even odds: it may be seen
        np.testing.assert_allclose(of(hardly), np.logaddexp(own, hiding), atol=1e-5)


@pytest.mark.parametrize(("farther", "part", "of_solids"), [(0.0, 1.0, 0.0), (0.1, 1.15, 0.0), (1.0, 2.0, 2.0)])
def test_what_is_inside_a_blob_does_not_hide_it(farther, part, of_solids):
    """A hand of 6 cm, behind another by so many times what of two that touch: what optical depth is before it."""
    sigma, rig = 0.06 / TOUCHING, ring_rig(1, (160, 120), distance=2.0)
    away = np.asarray(rig.cameras.camera_from_world[0, 2, :3])
    means = jnp.asarray(np.array([0.0, 0.0, 1.2]) + np.outer([0.0, farther * 0.12], away), jnp.float32)
    blobs = Sog(means, jnp.full(2, sigma), jnp.zeros((2, 3)), jnp.ones(2, bool))
    parts = jnp.asarray(1.0 - np.eye(2), jnp.float32)
    limbs = LimbBlobs(jnp.eye(2, dtype=bool), jnp.eye(2), parts, (0, 0))
    found = visible_parts(limbs, blobs, jax.vmap(project, in_axes=(0, None))(rig.cameras, blobs), rig.cameras)
    np.testing.assert_allclose(-np.log(found.part[0, 1]), part, rtol=0.02)
    np.testing.assert_allclose(-np.log(found.of_solids[0, 1]), of_solids, atol=1e-4)
    assert farther == 0.0 or float(found.part[0, 0]) > float(found.part[0, 1])


def test_densities_of_colours_are_those_of_the_subjects_table():
    """For a subject of one colour the table and the formula are the same, but for the width of the bins."""
    color = np.array([[0.7, 0.3, 0.2]])
    table = jnp.asarray(subject_colors(color, np.ones(1)), jnp.float32)
    middles = (np.random.default_rng(0).integers(0, 32, (200, 3)) + 0.5) / 32
    colors = jnp.asarray(middles, jnp.float32)
    np.testing.assert_allclose(
        own_density(colors, jnp.asarray(color, jnp.float32)), subject_density(colors, table), atol=1e-4
    )


def test_doubt_grows_with_every_measure():
    kept = fitted_numbers().limb_weights
    for weights in (kept.with_background, kept.without_background):
        values = jnp.linspace(0.0, 1.0, 5)
        worse = error_probability(LimbMeasures(values, jnp.full(5, 0.2)), weights)
        against = error_probability(LimbMeasures(jnp.full(5, 0.2), values), weights)
        assert (np.diff(worse) > 0.0).all()
        assert (np.diff(against) >= 0.0).all()


def test_limbs_are_called_by_their_ends():
    human, dog = shipped("human"), shipped("dog")
    assert set(limb_names(human)) == {"left arm", "right arm", "left leg", "right leg", "head"}
    assert {"tail", "head", "left front leg", "right hind leg"} < set(limb_names(dog))
    for body in (human, dog):
        of_joint = joint_limbs(body.skeleton)
        elbow = of_joint[list(body.skeleton.names).index("left_elbow")]
        assert limb_names(body)[elbow] in ("left arm", "left front leg")
        assert of_joint[0] == -1
    both = concatenate([replace(human, name="ann"), replace(dog, name="rex")])
    first, second = limb_slices([human, dog])
    assert limb_names(both)[first] == tuple(f"ann/{name}" for name in limb_names(human))
    assert limb_names(both)[second] == tuple(f"rex/{name}" for name in limb_names(dog))


def test_stretches_join_over_short_gaps_and_short_ones_are_left_out():
    motion = walking_motion(20)
    doubt = np.zeros((20, 2))
    doubt[[3, 4, 6, 7, 15], 0] = 0.9
    doubt[10:14, 1] = 0.8
    motion = replace(motion, limb_names=np.array(["arm", "leg"]), joint_limb=np.zeros(9, int), limb_doubt=doubt)
    found = doubtful_limbs(motion)
    first = int(motion.frame[0])
    assert [(limb.name, limb.first_frame - first, limb.last_frame - first) for limb in found] == [
        ("arm", 3, 7),
        ("leg", 10, 13),
    ]
    assert found[1].doubt == pytest.approx(0.8)
    assert str(found[1]).startswith(f"leg doubtful in frames {first + 10} to {first + 13}")
    assert doubtful_limbs(walking_motion(3)) == ()


def test_background_that_was_always_seen_in_a_limb_s_place_is_no_reason_for_doubt():
    """Dark shoes on a dark floor: what counts is that more is seen than usual."""
    limbs = LimbBlobs.from_body(shipped("dog"))
    blobs = limbs.members.shape[1]
    evidence = BlobEvidence(jnp.full(blobs, 1.0), jnp.full(blobs, 0.9), jnp.ones(blobs), jnp.ones(blobs))
    fits = jnp.ones(blobs)
    always = limb_confidence(limbs, evidence, jnp.stack([fits, jnp.full(blobs, 0.6)]), True)
    suddenly = limb_confidence(limbs, evidence, jnp.stack([fits, jnp.zeros(blobs)]), True)
    assert float(always.error_probability.max()) < 0.05 < 0.2 < float(suddenly.error_probability.min())


def test_a_limb_is_the_more_doubtful_the_more_its_rival_gains_and_none_reassures():
    unlike, gains = np.full(5, 0.1), np.array([2.0 * LEAST_RIVAL, LEAST_RIVAL, 0.5 * LEAST_RIVAL, MOST_RIVAL, 0.5])
    said = beside_rivals(unlike, gains)
    assert unlike[0] == said[0] == said[1] < said[2] < said[3] == said[4]
    assert said[3] > fitted_numbers().rivals.doubtful
    assert (np.diff(beside_rivals(np.linspace(0.0, 1.0, 9), np.full(9, -0.001))) >= 0.0).all()
    assert beside_rivals(np.array([0.3, 0.0]), np.full(2, np.nan)).tolist() == [0.3, 0.0]
    np.testing.assert_allclose(beside_rivals(np.array([0.5]), np.array([0.0]), 2.0), expit(1.0))


def test_less_is_enough_for_doubt_where_rivals_are_known():
    numbers, between = fitted_numbers(), 0.35
    assert numbers.rivals.doubtful < between < numbers.verdict.limb_doubtful
    judged = replace(
        walking_motion(num_frames=9),
        limb_names=np.array(["head", "left leg"]),
        limb_doubt=np.full((9, 2), between),
        limb_rival=np.tile([np.nan, 0.0], (9, 1)),
    )
    assert [limb.name for limb in doubtful_limbs(judged)] == ["left leg"]
    assert in_doubt(judged, 0.2).all()
    assert not in_doubt(replace(judged, limb_rival=None)).any()


def test_who_is_doubted_for_a_rival_alone_might_as_well_be_elsewhere():
    walk = walking_motion(num_frames=20)
    doubt, unlike = np.zeros((20, 2)), np.zeros((20, 2))
    doubt[5:12], unlike[5:12, 1] = 0.8, 0.6
    judged = replace(walk, limb_names=np.array(["head", "left leg"]), limb_doubt=doubt, limb_unlike=unlike)
    judged = replace(judged, limb_rival=np.zeros_like(doubt))
    both = doubtful_limbs(judged)
    assert [limb.elsewhere for limb in both] == [True, False]
    assert "might as well be elsewhere" in str(both[0])
    for without in ({"limb_unlike": None}, {"limb_rival": np.full_like(doubt, np.nan)}):
        assert not any(limb.elsewhere for limb in doubtful_limbs(replace(judged, **without)))
    behind = doubtful_limbs(replace(judged, limb_hidden=np.full((20, 2), 0.9)))
    assert [(limb.hidden, limb.elsewhere) for limb in behind] == [(True, False)] * 2
