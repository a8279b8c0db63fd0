"""Limbs held in other ways: what a part adds to the energy, which ways are tried, what is found undoubted."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from rig_cases import ring_rig
from sog_cases import floats, random_views
from test_both_ways import LOST, reader, with_lost_limb
from test_energy_gradient import precise

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.part_energy import PartEnergy
from sogjax.energy.posed import History
from sogjax.energy.views import Windows
from sogjax.model import cores as cores_of
from sogjax.model.body import concatenate
from sogjax.model.limbs import limb_names
from sogjax.model.solid import Solid, impossibilities
from sogjax.quality.limb_confidence import LEAST_RIVAL
from sogjax.search import climbed, limb_search
from sogjax.search import merge_passes as merging
from sogjax.search.climbed import climbed_in
from sogjax.search.held_otherwise import NUM_CLIMBED
from sogjax.search.limb_search import BetterPose, LimbSearch, compile_search, in_lanes
from sogjax.search.limb_ways import UnitArrays, drawn_ways, look_alikes, units_of
from sogjax.search.merge_passes import merge_passes
from sogjax.search.placed_body import means_of
from sogjax.search.worth import IMPOSSIBLE_COST
from sogjax.tracking.frame import on_device
from sogjax.tracking.frame_by_frame import track

HUMAN = shipped("human")


def with_random_foreground(views, rng):
    """The views with a grid of log odds over the whole of each picture."""
    cameras, cells = len(views.normalizers), 12
    width, height = (float(size) for size in views.cameras.image_size[0])
    along = lambda size: floats(np.broadcast_to((np.arange(cells) + 0.5) * size / cells, (cameras, 1, cells)))
    step = floats(np.broadcast_to((width / cells, height / cells), (cameras, 1, 2)))
    return replace(
        views, windows=Windows(along(width), along(height), step, floats(rng.normal(size=(cameras, 1, cells, cells))))
    )


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_what_a_part_adds_is_what_the_energy_of_the_whole_gains(number):
    """To rounding, with the caps and the cover of the rest; its gradient is that of autodiff."""
    with jax.enable_x64(True):
        body, rng = precise(HUMAN), np.random.default_rng(number)
        pose = np.asarray(body.poses["arms_forward"], float)
        views = random_views(ring_rig(3).cameras, body, number, pose=floats(pose))
        views = with_random_foreground(views, rng)
        terms = standard_terms(floats(0.7), foreground_weight=floats(0.2))
        units = units_of(body)
        index = UnitArrays.of(body, units)[number].index
        moves = np.isin(np.arange(len(pose)), units[number].all_dofs)
        others = [pose, *(pose + moves * rng.normal(0.0, 0.4, len(pose)) for _ in range(2))]
        energy = FrameEnergy(body, views, History.unknown(floats(pose)), terms)
        whole = jax.jit(lambda pose: energy(pose))
        part = PartEnergy.around(body, views, terms, floats(pose), index)
        params = jnp.stack([index.params(floats(other)) for other in others])
        (values, slopes), models = jax.jit(
            lambda params: (jax.vmap(jax.value_and_grad(part))(params), jax.vmap(part.quadratic)(params))
        )(params)
        expected = [float(whole(floats(other))) for other in others]
        assert np.ptp(expected) > 1e-4
        np.testing.assert_allclose(np.diff(values), np.diff(expected), rtol=1e-8, atol=1e-12)
        np.testing.assert_allclose(models.value, values, rtol=1e-10)
        np.testing.assert_allclose(models.gradient, slopes, atol=1e-8 * float(jnp.max(jnp.abs(slopes))))


def test_units_are_pairs_of_limbs_of_each_actor():
    assert [unit.name for unit in units_of(HUMAN)] == ["left leg and right leg", "left arm and right arm"]
    both = concatenate([replace(HUMAN, name="anna"), replace(HUMAN, name="ben")])
    names = [unit.name for unit in units_of(both)]
    assert len(names) == 4
    assert all(name.count(actor) in (0, 2) for name in names for actor in ("anna", "ben"))


def alike_of(number, pose):
    unit = UnitArrays.of(HUMAN, units_of(HUMAN))[number]
    found = jax.jit(look_alikes)(HUMAN, jnp.asarray(pose), unit)
    return np.asarray(found)


def test_what_looks_alike_has_its_legs_exchanged_or_its_knees_on_the_other_side():
    pose = np.asarray(HUMAN.poses["walk_left"])
    exchanged, lower, left, right, both = alike_of(0, pose)
    names = list(HUMAN.blobs.names)
    at = lambda pose, name: means_of(HUMAN, np.asarray(pose)[None])[0, names.index(name)]
    apart = lambda one, two: float(np.linalg.norm(one - two))
    crossed = apart(at(exchanged, "left_shank4"), at(pose, "right_shank4"))
    assert crossed < 0.4 * apart(at(pose, "left_shank4"), at(pose, "right_shank4"))
    legs, arms = (unit.all_dofs for unit in units_of(HUMAN))
    others = np.setdiff1d(np.arange(len(pose)), legs)
    for found in (exchanged, lower, left, right, both):
        np.testing.assert_array_equal(found[others], pose[others])
    sides = (("left", "right"), ("right", "left"))
    before, after = (
        [apart(at(each, f"{side}_toes"), at(pose, f"{other}_toes")) for side, other in sides] for each in (pose, lower)
    )
    assert np.less(after, before).all()
    assert sum(after) < 0.7 * sum(before)
    for side, _ in sides:
        assert apart(at(lower, f"{side}_thigh1"), at(pose, f"{side}_thigh1")) < 0.05
    first, second = units_of(HUMAN)[0].dofs
    np.testing.assert_allclose(left[second], pose[second], atol=0.1)
    np.testing.assert_allclose(right[first], pose[first], atol=0.1)
    assert len(arms)


def test_what_looks_like_arms_moves_nothing_else():
    """There are fewer degrees of freedom and blobs than in legs: the arrays are padded."""
    pose = np.asarray(HUMAN.poses["elbows"])
    arms = units_of(HUMAN)[1]
    others = np.setdiff1d(np.arange(len(pose)), arms.all_dofs)
    for found in alike_of(1, pose):
        np.testing.assert_array_equal(found[others], pose[others])
        moved = np.linalg.norm(means_of(HUMAN, found[None]) - means_of(HUMAN, pose[None]), axis=-1)[0]
        assert moved[arms.all_blobs].max() > 0.1
        assert np.delete(moved, arms.all_blobs).max() < 1e-5


def test_drawn_ways_lie_within_the_limits_and_are_others_each_turn():
    pose, unit = np.asarray(HUMAN.poses["tpose"]), units_of(HUMAN)[1]
    one, two = (drawn_ways(HUMAN, unit, pose, turn) for turn in (0, 1))
    others = np.setdiff1d(np.arange(len(pose)), unit.all_dofs)
    np.testing.assert_array_equal(one[:, others], np.tile(pose[others], (len(one), 1)))
    lower, upper = (np.asarray(bound)[unit.all_dofs] for bound in (HUMAN.skeleton.dof_lower, HUMAN.skeleton.dof_upper))
    for ways in (one, two):
        assert np.all(ways[:, unit.all_dofs] >= np.minimum(lower, pose[unit.all_dofs]) - 1e-5)
        assert np.all(ways[:, unit.all_dofs] <= np.maximum(upper, pose[unit.all_dofs]) + 1e-5)
    alone = [np.all(one[:, dofs] == pose[dofs], axis=1) for dofs in unit.dofs]
    assert alone[0].any()
    assert alone[1].any()
    assert (~alone[0] & ~alone[1]).any()
    assert np.abs(one - two).max() > 0.1


@pytest.mark.parametrize("cores", [1, 2, 4])
def test_lanes_are_the_same_on_any_number_of_cores(cores, monkeypatch):
    monkeypatch.setattr(cores_of, "usable_cores", lambda: cores)
    with_lane = lambda lane, row: (lane, row)
    assert in_lanes(with_lane, range(3, 8)) == [(0, 3), (0, 4), (0, 5), (1, 6), (1, 7)]
    assert in_lanes(with_lane, [5]) == [(0, 5)]
    assert in_lanes(with_lane, []) == []


@pytest.mark.slow
def test_each_lane_draws_ways_of_its_own(walking_dog):
    tracker, cells, right = walking_dog
    search, pose = LimbSearch.of(tracker, right.capacities), right.poses[1]
    tried = lambda lane: search._tried(0, search.units[0], pose, lane)
    views, seen = search.views(on_device(cells[1]), pose), []
    for lane in (0, 1, 0, 1):
        search.held_otherwise(views, pose, lane)
        seen.append(tried(lane)[NUM_CLIMBED - 1 :])
    assert all(np.abs(one - other).max() > 0.1 for k, one in enumerate(seen) for other in seen[:k])


@pytest.mark.slow
def test_a_lost_limb_that_nobody_doubts_is_found_in_a_key_frame(walking_dog):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog, doubt=0.0)
    assert not merge_passes(tracker, passed, reader(cells)).frames
    energies = right.energies.copy()
    energies[LOST] *= 0.9  # what a pass that has lost a leg is worth
    passed = replace(passed, energies=energies)
    found = merge_passes(tracker, passed, reader(cells), range(0, len(cells), 5))
    assert limb_names(tracker.body)[limb] in found.parts
    assert {4, 5, 6} <= {*found.frames}
    for row in (4, 5, 6):
        off = means_of(tracker.body, found.frames[row].pose[None]) - means_of(tracker.body, right.poses[[row]])
        assert np.linalg.norm(off, axis=-1).max() < 0.02


@pytest.mark.slow
def test_a_lost_limb_has_a_rival_and_one_in_its_place_has_none(walking_dog, monkeypatch):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog, doubt=0.0)
    search, row = LimbSearch.of(tracker, right.capacities), LOST.start + 1
    frame = lambda: cells[row]
    assert search.rivals(frame, passed, row)[limb] > 0.0
    rivals = search.rivals(frame, right, row)  # the pose changed: they are searched again
    assert len(rivals) == len(limb_names(tracker.body))
    assert rivals[limb] < -0.002
    searched = sorted(limb for unit in search.units for limb in unit.limbs)
    assert np.flatnonzero(np.isfinite(rivals)).tolist() == searched
    np.testing.assert_array_equal(search.rivals(lambda: pytest.fail("read again"), right, row), rivals)
    held = search.held_otherwise(search.views(on_device(cells[row]), right.poses[row]), right.poses[row])
    here = means_of(tracker.body, right.poses[[row]])
    for unit, poses in zip(search.units, held.poses, strict=True):  # each limb is elsewhere in some way
        moved = np.linalg.norm(means_of(tracker.body, poses) - here, axis=-1)
        assert all((moved[:, blobs[-1]] > 0.1).any() for blobs in unit.blobs)


@pytest.mark.slow
def test_rivals_are_those_of_the_poses_that_are_kept(walking_dog):
    tracker, cells, right = walking_dog
    passed, limb = with_lost_limb(walking_dog, doubt=0.0)
    energies = right.energies.copy()
    energies[LOST] *= 0.9
    keys = range(0, len(cells), 5)
    found = merge_passes(tracker, replace(passed, energies=energies), reader(cells), keys)
    assert [*found.rivals] == [*keys]
    assert 5 in found.frames  # its limb was found
    assert found.rivals[5][limb] < -0.002


@pytest.mark.slow
def test_rivals_that_are_impossible_or_near_do_not_count(walking_dog, monkeypatch):
    tracker, cells, right = walking_dog
    search, row = LimbSearch.of(tracker, right.capacities), 3
    pose, unit = right.poses[row], search.units[0]
    found = search.held_otherwise(search.views(on_device(cells[row]), pose), pose)
    limbs = [*unit.limbs]
    with_gains = lambda gain: eqx.tree_at(lambda held: held.gains, found, np.full_like(found.gains, gain))
    near = eqx.tree_at(lambda held: held.poses, with_gains(100.0), np.tile(pose, (*found.gains.shape, 1)))
    among = lambda held: search._rivals_among(pose, held.poses, held.gains.astype(float), right.energy)[limbs]
    assert (among(near) == LEAST_RIVAL).all()
    worth = with_gains(0.01 * right.energy)
    np.testing.assert_allclose(among(worth).max(), 0.01, rtol=1e-5)  # a climb may have led back
    monkeypatch.setattr(LimbSearch, "possible", lambda _, known, poses: np.zeros(len(poses), bool))
    assert (among(worth) == LEAST_RIVAL).all()


@pytest.mark.slow
def test_what_is_compiled_beforehand_is_what_the_search_for_limbs_takes(walking_dog, monkeypatch):
    """Tracking tells of its first frame once, before it compiles its step."""
    tracker, cells, right = walking_dog
    told, traces = [], []

    def watch(module, name):
        as_written = getattr(module, name).__wrapped__  # a function of its own: what others traced does not count
        watched = eqx.filter_jit(lambda *given: traces.append(name) or as_written(*given))
        monkeypatch.setattr(module, name, watched)

    watch(limb_search, "held_otherwise")
    watch(climbed, "_climbed_in")
    tracked = track(tracker, jnp.asarray(right.poses[0]), cells[:2], told=lambda *given: told.append(given))
    capacities = [frame.capacities for frame in tracked]
    assert [given[2] for given in told] == capacities[:1]
    compile_search(tracker, *told[0])
    assert {*traces} == {"held_otherwise", "_climbed_in"}
    traces.clear()
    search, pose = LimbSearch.of(tracker, capacities[0]), right.poses[1]
    search.better_pose(cells[1], replace(right, capacities=capacities[0]), 1)
    search.climbed(search.views(on_device(cells[1]), pose), pose, pose[None], np.array([0.2]))
    assert not traces


def test_a_pose_is_the_less_likely_the_deeper_a_leg_is_in_the_other():
    body = shipped("human")
    solid, side = Solid.of(body), body.skeleton.dof_names.index("left_hip_side")
    poses = np.tile(np.asarray(body.poses["rest"]), (5, 1))
    poses[:, side] = (0.0, -0.1, -0.3, -0.4, -0.8)
    none, apart, slight, deep, deepest = np.asarray(impossibilities(solid, body, jnp.asarray(poses)))
    assert none == apart == 0.0
    assert 0.0 < slight < deep <= deepest == 1.0


@pytest.mark.slow
def test_no_pass_begins_where_one_went_in_vain(walking_dog, monkeypatch):
    tracker, cells, right = walking_dog
    search = LimbSearch.of(tracker, right.capacities)
    other = right.poses[1].copy()
    other[search.units[0].all_dofs] += 0.5
    held = search.held_otherwise(search.views(on_device(cells[1]), right.poses[1]), right.poses[1])
    monkeypatch.setattr(LimbSearch, "held_otherwise", lambda *_: held)
    monkeypatch.setattr(LimbSearch, "_rivals_among", lambda *_: None)
    monkeypatch.setattr(LimbSearch, "_starts", lambda *_: (other[None], other[:0].reshape(0, len(other))))
    monkeypatch.setattr(LimbSearch, "possible", lambda _, known, poses: np.ones(len(poses), bool))
    worth_more = lambda start: jnp.float32(np.array_equal(start, other))
    monkeypatch.setattr(limb_search, "climbed_in", lambda _, views, start, share, room: (start, worth_more(start)))
    better = lambda row: None if (found := search.better_pose(cells[row], right, row)) is None else found.pose
    assert not search.is_in_vain(1, other)
    assert np.array_equal(better(1), other)
    search.note_in_vain([1], [other], [0.1])
    assert np.array_equal(better(1), other)  # it gained there: one more may begin
    search.note_in_vain([1], [other], [0.1])
    assert better(1) is None
    assert search.is_in_vain(1, other)
    search.forget_in_vain([1])
    search.note_in_vain([1], [other], [-0.1])
    assert better(1) is None
    assert np.array_equal(better(2), other)
    search.forget_in_vain([1])
    assert np.array_equal(better(1), other)


@pytest.mark.slow
def test_passes_begin_where_most_is_gained_and_where_nothing_changed_meanwhile(walking_dog, monkeypatch):
    tracker, cells, right = walking_dog
    search, begun = LimbSearch.of(tracker, right.capacities), []
    revising = merging._Revising(tracker, right, lambda rows: [cells[row] for row in rows])
    away = lambda row, far: right.poses[row] + np.float32(far) * np.isin(np.arange(right.poses.shape[1]), dofs)
    dofs, gains, asked = search.units[0].all_dofs, {0: 0.1, 1: 0.0, 2: 0.4, 3: 0.3, 4: 0.2, 5: 0.05}, []

    def better_pose(_, frame, passed, row, lane=0):
        asked.append(row)
        far = 1.0 if asked.count(row) > 1 else 0.5
        return BetterPose(away(row, far), gains[row]) if gains[row] else None

    def begin(search, row, pose, patience=0):
        begun.append((row, np.array_equal(pose, away(row, 0.5))))
        if row == 2:
            revising.known.changed |= {2, 3}
        if row == 4:  # its pass went in vain where the one of row 0 would begin
            search.note_in_vain([0], [away(0, 0.5)], [-0.1])

    monkeypatch.setattr(LimbSearch, "better_pose", better_pose)
    monkeypatch.setattr(revising, "_pass_from", begin)
    monkeypatch.setattr(revising, "_tired", lambda row=None: row == 5)
    revising.known.changed |= {4}  # by what was done before
    revising._search_limbs(search, [*gains], lambda share: None)
    assert begun == [(2, True), (4, True), (0, False)]


@pytest.mark.slow
def test_a_climb_makes_its_share_of_the_solvers_iterations(walking_dog):
    tracker, cells, right = walking_dog
    pose = right.poses[1]
    search, start = LimbSearch.of(tracker, right.capacities), pose + np.float32(0.1)
    views = search.views(on_device(cells[1]), pose)
    climb = lambda share: climbed_in(tracker, views, start, share, right.capacities)
    (unmoved, first), (_, few), (_, last) = map(climb, (0.0, 0.04, 1.0))
    np.testing.assert_array_equal(unmoved, start)
    assert first < few < last
    ends, gains = search.climbed(views, pose, np.stack([start, pose]), np.array([1.0, 0.0]))
    known = climbed_in(tracker, views, pose, 0.0, right.capacities)[1]
    np.testing.assert_array_equal(ends[1], pose)
    np.testing.assert_allclose(gains, [last - known, 0.0], atol=1e-3)


@pytest.mark.slow
def test_a_right_pass_stays_as_it_is_when_limbs_are_searched(walking_dog):
    tracker, cells, right = walking_dog
    sound = replace(right, doubts=np.zeros_like(right.doubts))
    assert not merge_passes(tracker, sound, reader(cells), range(0, len(cells), 3)).frames


@pytest.mark.slow
def test_exchanged_ends_are_rivals_where_they_may_be_worth_as_much(walking_dog, monkeypatch):
    tracker, cells, right = walking_dog
    search, row, energy = LimbSearch.of(tracker, right.capacities), 3, right.energy
    pose = right.poses[row]
    views = search.views(on_device(cells[row]), pose)
    found = jax.device_get(search.held_otherwise(views, pose))
    elsewhere = found.poses[0, np.argmax(found.apart[0])]
    monkeypatch.setattr(limb_search, "ELSEWHERE", 0.25 * found.apart[0].max())
    crossed = np.stack([elsewhere, *found.crossed[1:]])
    parts = lambda held: (held.gains, held.crossed, held.crossed_gains, held.crossed_apart)
    loses = lambda loss: np.where(np.arange(len(crossed)) == 0, -loss, -1.0).astype(np.float32) * np.float32(energy)
    held, away = np.full_like(found.gains, -energy), np.ones(len(crossed), np.float32)
    with_losses = lambda loss, apart=1.0: eqx.tree_at(parts, found, (held, crossed, loses(loss), away * apart))
    climbed = []

    def gain(search, views, known, starts, shares):
        climbed.extend(starts)
        return starts, np.full(len(starts), 0.01 * energy)

    monkeypatch.setattr(LimbSearch, "climbed", gain)
    monkeypatch.setattr(LimbSearch, "possible", lambda _, known, poses: np.ones(len(poses), bool))
    among = lambda held: search._rivals_among(pose, *search._ways(views, pose, held, energy), energy)
    rivals = among(with_losses(0.01))
    np.testing.assert_array_equal(climbed, [elsewhere])
    of_first = [*search.units[0].limbs]
    np.testing.assert_allclose(rivals[of_first].max(), 0.01, rtol=1e-5)
    others = np.isfinite(rivals) & ~np.isin(np.arange(len(rivals)), of_first)
    assert (rivals[others] == LEAST_RIVAL).all()
    assert np.nanmax(among(with_losses(0.1))) == LEAST_RIVAL  # exchanged, they lose too much to be climbed
    assert np.nanmax(among(with_losses(0.01, apart=0.0))) == LEAST_RIVAL  # they are where they were
    assert len(climbed) == 1
    monkeypatch.setattr(LimbSearch, "_less_impossible", lambda _, pose, poses: np.ones(poses.shape[:-1]))
    gains = search._ways(views, pose, with_losses(0.01), energy)[1]
    np.testing.assert_allclose(gains[:, :-1], (IMPOSSIBLE_COST - 1.0) * energy, rtol=1e-5)
    assert gains[0, -1] == 0.01 * energy  # a climb counts it already
