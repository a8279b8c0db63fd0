"""The whole body in an example pose, searched by its masks: climbed from several starts, then its limbs searched.

Masks that are cut between people turn trunks round and tilt them, which no search of limbs mends.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from sogjax.actor.coverage import Silhouettes, mismatch_of, times_cap
from sogjax.actor.facing import forward
from sogjax.actor.limb_silhouettes import ITERATIONS, REST, Everybody, PoseAndMiss, with_limbs_found
from sogjax.energy.priors import limit_penalty
from sogjax.model.batches import THREADS, of_each, shared_out
from sogjax.model.body import Body
from sogjax.model.program import compiled
from sogjax.search.mirrored import look_alikes
from sogjax.search.placed_body import centred, centres_of, headings, turned_to
from sogjax.search.search_energy import from_rest
from sogjax.solve.ascent import ConditionedAscent
from sogjax.solve.solution import Scales
from sogjax.tracking.solving import pose_scales

NUM_HEADINGS = 8
"""Ways round in which a body at rest is put where it is, to be climbed."""
HOPELESS = 1.3
"""Times the least mismatch from which on a way round is not looked at any further: of 51 that were believed in the end
none was worse than 1.08 times before limbs were found."""


def upright_all_round(body: Body, up: str) -> list[Float[np.ndarray, "dof"]]:
    """A body at rest, turned to `NUM_HEADINGS`."""
    return [*turned_to(body, [np.asarray(body.poses["rest"])], headings(NUM_HEADINGS), up)]


@dataclass(frozen=True)
class WaysRound:
    """Ways to see somebody in an example pose, by what the others leave of its masks."""

    everybody: Everybody
    number: int
    """Which of the bodies."""
    up: str

    @property
    def body(self) -> Body:
        """The one that is searched."""
        return self.everybody.bodies[self.number]

    def found(
        self,
        poses: Sequence[Float[np.ndarray, "dof"]],
        silhouettes: Silhouettes,
        turn: int,
        starts: Sequence[Float[np.ndarray, "dof"]],
    ) -> list[PoseAndMiss]:
        """The body's pose, then the one that fits best after a climb, and the best of those that face the other way.

        The last is left out where it fits far worse. Each has its limbs found as by `with_limbs_found`, and comes with
        its mismatch. Climbed are, beside the pose, what looks like it from behind, and the `starts`, moved to where it
        is.
        """
        now = np.asarray(poses[self.number])
        climbed, misses = self._climbed(now, silhouettes, starts)
        facing = forward(self.body, list(climbed), self.up)
        best = int(np.argmin(misses))
        behind = np.flatnonzero((facing @ facing[best] <= 0.0) & (misses < HOPELESS * misses[best]))
        ways = [now, climbed[best], *climbed[behind[np.argsort(misses[behind])][:1]]]
        given = lambda start: [start if k == self.number else other for k, other in enumerate(poses)]
        held = [with_limbs_found(self.everybody, self.number, given(start), silhouettes, turn) for start in ways]
        return [(each, float(_whole_miss(self.body, jnp.asarray(each), silhouettes))) for each in held]

    def _climbed(
        self,
        pose: Float[np.ndarray, "dof"],
        silhouettes: Silhouettes,
        starts: Sequence[Float[np.ndarray, "dof"]],
    ) -> tuple[Float[np.ndarray, "way dof"], Float[np.ndarray, "way"]]:
        """Where the pose, what looks like it from behind, and the starts end, with mismatches."""
        there = centred(self.body, np.stack(starts), centres_of(self.body, pose[None])[0]) if len(starts) else []
        begun = np.stack([pose, *look_alikes(self.body, pose)[:1], *there]).astype(pose.dtype)
        given = (self.body, silhouettes, pose_scales(self.body.skeleton))
        room = -(-(2 + NUM_HEADINGS) // THREADS)
        climbed, misses = shared_out(lambda count, rows: _climbed(count, rows, *given), room, begun)
        return climbed, misses


@compiled
def _whole_miss(body: Body, pose: Float[Array, "dof"], silhouettes: Silhouettes) -> Float[Array, ""]:
    """The mismatch of the body, with `REST`."""
    return mismatch_of(times_cap(body.posed_blobs(pose), silhouettes), silhouettes) + REST * from_rest(
        body.skeleton, pose
    )


@compiled
def _climbed(
    count: Int[Array, ""],
    poses: Float[Array, "way dof"],
    body: Body,
    silhouettes: Silhouettes,
    scales: Scales,
) -> tuple[Float[Array, "way dof"], Float[Array, "way"]]:
    """The first `count` poses, climbed to where they cover the masks better, and mismatches with `REST` and limits."""
    lower, upper = body.skeleton.joint_limits()
    solver = ConditionedAscent(max_iterations=jnp.asarray(ITERATIONS))

    def climbed(pose: Float[Array, "dof"]) -> tuple[Float[Array, "dof"], Float[Array, ""]]:
        def objective(held: Float[Array, "dof"]) -> Float[Array, ""]:
            beyond = limit_penalty(body.skeleton.joint_params(held), lower, upper)
            return -_whole_miss(body, held, silhouettes) - beyond

        found = solver.maximize(objective, pose, scales)
        return found.params, -found.value

    return of_each(climbed, poses, count=count)
