"""A term of one's own in the energy: its model, every solver, all pairs and near ones, and the configuration."""

import sys
from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import random_body
from jaxtyping import Array
from rig_cases import ring_rig
from slow_values import fast_and_slow
from sog_cases import floats, in_float64, random_views

from sogjax.energy.frame_energy import FrameEnergy, standard_terms
from sogjax.energy.posed import History, Posed
from sogjax.energy.term import Penalty, Term, added_terms
from sogjax.errors import InputError
from sogjax.solve.ascent import ConditionedAscent, gradient_ascent
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.tracking.solving import pose_scales, solve_near

HEIGHT = 0.9


class Floor(Penalty):
    """Squared depths of blobs below the floor."""

    height: float = 0.0

    def value(self, posed, frame):
        depths = jnp.maximum(self.height - posed.blobs.means[:, 2], 0.0)
        return jnp.sum(depths**2)


class Spring(Penalty):
    """Squared distance of the pose from a target."""

    target: Array

    def value(self, posed, frame):
        return jnp.sum((posed.pose - self.target) ** 2)


class StraightSpring(Spring):
    """The same without its curvature."""

    def quadratic(self, posed, frame):
        model = super().quadratic(posed, frame)
        return eqx.tree_at(lambda m: m.curvature, model, jnp.zeros_like(model.curvature))


class Steady(Term):
    """Something gained that bends both ways: how far the head is turned, in waves."""

    def value(self, posed, frame):
        return jnp.sum(jnp.cos(3.0 * posed.joint_params)) + jnp.sum(posed.world_from_joint[:, 2, 3])


SOLVERS = {
    "gauss_newton": GaussNewton(epsilon=1e-3, max_iterations=100),
    "conditioned_ascent": ConditionedAscent(epsilon=1e-3, max_iterations=400),
    "gradient_ascent": gradient_ascent(epsilon=1e-3, max_iterations=400),
    "bfgs": OptimistixSolver("bfgs"),
    "lbfgs": OptimistixSolver("lbfgs"),
    "nonlinear_cg": OptimistixSolver("nonlinear_cg"),
}


def scene(terms=(), precise=False):
    """The energy of a small body and a pose near its optimum."""
    body = random_body(4, joints=5, dofs=4, blobs=6)
    body = eqx.tree_at(lambda b: b.blobs.offsets, body, body.blobs.offsets + jnp.array([[0.0, 0.0, 1.0]]))
    if precise:
        body = in_float64(body)
    views = random_views(ring_rig(2).cameras, body, 0, count=40)
    pose = floats(body.poses["rest"])
    return FrameEnergy(body, views, History.unknown(pose), (*standard_terms(), *terms)), pose


def lowest(energy, pose):
    return float(jnp.min(energy.body.posed_blobs(pose).means[:, 2]))


climb = eqx.filter_jit(lambda solver, energy, start, scales: solver.maximize(energy, start, scales))
climb_near = eqx.filter_jit(solve_near)
model_of = eqx.filter_jit(lambda term, posed, frame: (term.quadratic(posed, frame), Term.quadratic(term, posed, frame)))


@pytest.mark.slow
@pytest.mark.parametrize("pairs", fast_and_slow("sparse", "dense"))
@pytest.mark.parametrize("name", fast_and_slow(*SOLVERS))
def test_every_solver_climbs_an_energy_with_a_floor(name, pairs):
    """The body stands lower than the floor where the pictures show it; a heavy floor lifts it, whoever climbs."""
    free, start = scene()
    floor = lowest(free, start) + 0.1
    energy = eqx.tree_at(lambda e: e.terms, free, (*free.terms, Floor(3.0, height=floor)))
    scales = pose_scales(free.body.skeleton)

    def solved(energy):
        if pairs == "dense":
            return climb(SOLVERS[name], energy, start, scales)
        return climb_near(SOLVERS[name], energy, start, scales, 64)[0]

    without, found = solved(free), solved(energy)
    assert found.value > energy(start)
    np.testing.assert_allclose(found.value, energy(found.params), rtol=1e-4, atol=1e-6)
    depth = lambda pose: float(energy.values(pose)["floor"])
    assert depth(found.params) < 0.5 * depth(without.params)
    slope = jax.grad(energy)
    assert np.linalg.norm(slope(found.params)) < 0.1 * np.linalg.norm(slope(start))


@pytest.mark.slow
def test_gauss_newton_uses_the_curvature_of_a_term():
    """A quadratic is climbed in a step or two; without its curvature the steps are as long as they may be."""
    energy, start = scene()
    scales = pose_scales(energy.body.skeleton)
    solver = GaussNewton(first_damping=1e-4, smallest_damping=1e-4, common_damping=0.0, max_iterations=3)
    left = {}
    for kind in (Spring, StraightSpring):
        alone = eqx.tree_at(lambda e: e.terms, energy, (kind(1.0, target=start + 0.01),))
        left[kind] = -climb(solver, alone, start, scales).value
    assert left[Spring] < 1e-9 < 1e-6 < left[StraightSpring]


@pytest.mark.slow
@pytest.mark.parametrize("place", fast_and_slow(1, 2))
def test_the_model_from_autodiff_is_the_closed_one_where_that_is_exact(place):
    with jax.enable_x64(True):
        energy, pose = scene(precise=True)
        posed = Posed.from_pose(energy.body, pose + 2.0)  # beyond limits
        history = History(pose, pose - 0.3, jnp.asarray(True))
        own, general = model_of(energy.terms[place], posed, replace(energy.frame, history=history))
        assert np.abs(own.curvature).max() > 0.0
        for mine, other in zip(jax.tree.leaves(own), jax.tree.leaves(general), strict=True):
            np.testing.assert_allclose(mine, other, rtol=1e-9, atol=1e-12)


@pytest.mark.slow
def test_the_model_from_autodiff_has_value_and_gradient_and_bends_one_way_only():
    with jax.enable_x64(True):
        energy, pose = scene(precise=True)
        term = Steady(floats(0.7))
        alone = eqx.tree_at(lambda e: e.terms, energy, (term,))
        model = eqx.filter_jit(alone.quadratic)(pose + 0.5)
        value, gradient = eqx.filter_jit(lambda e, p: jax.value_and_grad(e)(p))(alone, pose + 0.5)
        np.testing.assert_allclose(model.value, value, rtol=1e-12)
        np.testing.assert_allclose(model.gradient, gradient, rtol=1e-10)
        eigenvalues = np.linalg.eigvalsh(model.curvature)
        assert eigenvalues.min() > -1e-12
        # cos(3 l) bends by 9 cos(3 l) along each joint parameter l = (M pose), which moves in straight lines.
        params = energy.body.skeleton.joint_params(pose + 0.5)
        transform = np.asarray(energy.body.skeleton.parameter_transform)
        bends = transform.T @ np.diag(0.7 * 9.0 * np.cos(3.0 * np.asarray(params))) @ transform
        values, vectors = np.linalg.eigh(bends)
        np.testing.assert_allclose(model.curvature, (vectors * np.maximum(values, 0.0)) @ vectors.T, atol=1e-9)
        assert values.min() < 0.0


@pytest.mark.slow
def test_a_penalty_is_subtracted_and_a_term_added():
    floor, steady = Floor(2.0, height=HEIGHT), Steady(0.5)
    energy, pose = scene((floor, steady))
    values = eqx.filter_jit(energy.values)(pose)
    assert values.keys() == {"similarity", "limit_penalty", "acceleration_penalty", "floor", "steady"}
    assert values["floor"] > 0.0
    plain, _ = scene()
    expected = plain(pose) - 2.0 * values["floor"] + 0.5 * values["steady"]
    np.testing.assert_allclose(energy(pose), expected, rtol=1e-5)
    given = energy.values_given(pose, energy(pose))
    np.testing.assert_allclose(given["similarity"], values["similarity"], rtol=1e-4)


@pytest.mark.slow
def test_numbers_of_a_term_can_be_swept_and_differentiated_by():
    energy, pose = scene((Floor(2.0, height=HEIGHT),))
    by_floor = eqx.filter_jit(eqx.filter_grad(lambda e: e(pose)))(energy).terms[3]
    depths = np.maximum(HEIGHT - np.asarray(energy.body.posed_blobs(pose).means)[:, 2], 0.0)
    np.testing.assert_allclose(by_floor.weight, -np.sum(depths**2), rtol=1e-5)
    np.testing.assert_allclose(by_floor.height, -2.0 * np.sum(2.0 * depths), rtol=1e-5)


def test_two_terms_of_one_name_are_refused():
    with pytest.raises(ValueError, match="same name"):
        scene((Floor(1.0), Floor(2.0)))
    energy, _ = scene((Floor(1.0), Floor(2.0, name="ceiling")))
    assert [term.name for term in energy.terms][-2:] == ["floor", "ceiling"]


def test_terms_are_made_from_a_configuration():
    (term,) = added_terms("energy.terms", {"ground": {"term": "test_terms.Floor", "weight": 2, "height": 1}}, [])
    assert (term.name, float(term.weight), float(term.height)) == ("ground", 2.0, 1.0)
    assert jnp.issubdtype(term.height.dtype, jnp.floating)


@pytest.mark.parametrize(
    ("entry", "complaint"),
    [
        (3, r"energy\.terms\.ground: is not a term; write"),
        ({"weight": 1}, r"energy\.terms\.ground: is not a term; write"),
        ({"term": "Floor"}, "must name a module and a class"),
        ({"term": "no_such_module.Floor"}, "the module no_such_module cannot be imported"),
        ({"term": "test_terms.Ceiling"}, "test_terms has no such class"),
        ({"term": "test_terms.HEIGHT"}, r"is not a sogjax\.Term"),
        ({"term": "sogjax.energy.term.Penalty", "weight": 1}, "has no method `value`"),
        ({"term": "test_terms.Floor"}, r"cannot be made \(missing a required argument: 'weight'\); it takes weight, h"),
        ({"term": "test_terms.Floor", "weight": 1, "hight": 2}, r"unexpected keyword argument 'hight'"),
        ({"term": "test_terms.Floor", "weight": "much"}, r"ground\.weight=much: must be a finite number"),
    ],
)
def test_a_wrong_term_is_said_in_one_sentence(entry, complaint):
    with pytest.raises(InputError, match=complaint):
        added_terms("energy.terms", {"ground": entry}, ["similarity"])


def test_terms_without_names_are_refused():
    with pytest.raises(InputError, match=r"energy\.terms=floor: must be terms by name, {NAME: {term"):
        added_terms("energy.terms", "floor", [])
    assert added_terms("energy.terms", None, []) == ()


def test_a_name_that_is_taken_is_refused():
    with pytest.raises(InputError, match=r"energy\.terms\.similarity: the energy has a term of this name already"):
        added_terms("energy.terms", {"similarity": {"term": "test_terms.Floor", "weight": 1}}, ["similarity"])


def test_modules_are_found_in_the_current_folder(tmp_path, monkeypatch):
    (tmp_path / "my_floor_module.py").write_text(
        "from sogjax.energy.term import Penalty\n"
        "class Low(Penalty):\n"
        "    def value(self, posed, frame):\n"
        "        return posed.pose[0] ** 2\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [p for p in sys.path if p])
    (term,) = added_terms("energy.terms", {"low": {"term": "my_floor_module.Low", "weight": 1}}, [])
    assert term.name == "low"
    assert str(tmp_path) not in sys.path
