"""The way of a solver through one frame."""

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import cells_of, draw, in_colors, make_tracker, moved, standing
from rig_cases import ring_rig

from sogjax.solve.ascent import ConditionedAscent
from sogjax.solve.gauss_newton import GaussNewton
from sogjax.solve.optimistix import OptimistixSolver
from sogjax.tracking.capacity import first_capacities
from sogjax.tracking.frame import FrameInput, TrackState
from sogjax.tracking.frame_by_frame import best_after, track

SOLVERS = {
    "ascent": ConditionedAscent(),
    "Gauss-Newton": GaussNewton(),
    "L-BFGS": OptimistixSolver("lbfgs"),
}


@pytest.mark.slow
@pytest.mark.parametrize("solver", SOLVERS.values(), ids=SOLVERS)
def test_it_leads_upwards_from_the_start_to_what_tracking_finds(solver):
    body, rig = in_colors(shipped("dog")), ring_rig(4, (160, 120), distance=1.6)
    truth = standing(body, 1.1)
    start = jnp.asarray(moved(body, truth, {"root_x": 0.03, "root_yaw": 0.05, "neck_bend": 0.1}))
    tracker, cells = make_tracker(body, rig, 6, solver), cells_of(rig, draw(body, truth, rig), 6)
    (tracked,) = track(tracker, start, [cells])
    state = TrackState.from_pose(start)
    room = first_capacities(tracker, state, FrameInput(jnp.asarray(cells)))
    counts = jnp.arange(int(tracked.result.iterations) + 1)
    poses, energies = best_after(tracker, state, jnp.asarray(cells), room, counts)
    np.testing.assert_array_equal(poses[0], start)
    assert np.all(np.diff(np.asarray(energies)) >= -1e-6)
    assert energies[-1] > energies[0]
    np.testing.assert_allclose(poses[-1], tracked.result.pose, atol=1e-3)
    np.testing.assert_allclose(energies[-1], tracked.result.energy, rtol=1e-4)
