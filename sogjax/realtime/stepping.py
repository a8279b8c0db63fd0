"""The tracker's step as a live run takes it: by true times, with all cameras or some, and joints at once."""

import time
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.model.program import compiled
from sogjax.run.terminal import say
from sogjax.tracking.capacity import first_capacities, larger_capacities
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, FrameResult, TrackedFrame, TrackState, on_host
from sogjax.tracking.tracker import Tracker

LONGEST_PAUSE = 3.0
"""A motion goes on for so many of its last steps at most, where no pictures came for longer."""
ROOM = 2
"""Times the usual room that is kept ready."""


@dataclass(frozen=True)
class Moment:
    """The tracker's memory after a frame, and when that frame and the one before it were taken."""

    state: TrackState
    exposed: float | None = None
    step: float | None = None
    """Seconds between those two."""


@dataclass
class LiveStep:
    """One compiled step for all frames, whichever cameras they have.

    The pose is predicted by the time that passed: where a frame was left out, the motion goes on for twice as long.
    """

    tracker: Tracker
    capacities: Capacities | None = None
    spare: Capacities | None = None
    """Room for a frame that needs more; compiled beforehand, as making more takes seconds."""

    def start(self, pose: Float[np.ndarray | Array, "dof"]) -> Moment:
        """Before the first frame, from a rough pose of it."""
        return Moment(self.tracker.start(jnp.asarray(pose, jnp.float32)))

    def __call__(
        self,
        moment: Moment,
        cells: UInt8[np.ndarray, "camera rows columns 3"],
        present: Bool[np.ndarray, "camera"],
        exposed: float,
    ) -> tuple[Moment, TrackedFrame, Float[np.ndarray, "joint 4 4"]]:
        """Find the pose of a frame that was taken at a time (seconds).

        Raises:
            InputError: more image blobs than there can be room for.
        """
        begin = time.perf_counter()
        frame = FrameInput(jnp.asarray(cells), jnp.asarray(present))
        step = None if moment.exposed is None else exposed - moment.exposed
        ratio = 1.0 if step is None or not moment.step else min(max(step / moment.step, 0.0), LONGEST_PAUSE)
        if self.capacities is None:
            self.capacities = first_capacities(self.tracker, moment.state, frame)
            self.spare = self.capacities.times(ROOM)
        while True:
            used = self.capacities
            state, result, joints = _step(self.tracker, moment.state, frame, jnp.asarray(ratio, jnp.float32), used)
            found, world_from_joint = on_host(result), np.asarray(joints)
            near, matching = int(found.num_near.max()), int(found.num_matching.max())
            if used.hold(near, matching, int(found.num_blocks)):
                break
            self._make_room(used, near, matching, int(found.num_blocks))
        tracked = TrackedFrame(0, found, used, self.tracker.reader.color_space, time.perf_counter() - begin)
        return Moment(state, exposed, step), tracked, world_from_joint

    def _make_room(self, used: Capacities, near: int, matching: int, blocks: int) -> None:
        if self.spare is not None and self.spare != used and self.spare.hold(near, matching, blocks):
            self.capacities = self.spare
            return
        say("more is seen than ever before: the tracker makes room, which takes some seconds")
        self.capacities = larger_capacities(used, near, matching, blocks)


@compiled
def _step(
    tracker: Tracker, state: TrackState, frame: FrameInput, ratio: Float[Array, ""], capacities: Capacities
) -> tuple[TrackState, FrameResult, Float[Array, "joint 4 4"]]:
    """A step after `ratio` times the last one's duration, and where the joints are then."""
    before = state.previous - ratio * (state.previous - state.before_previous)
    state, result = tracker.step(replace(state, before_previous=before), frame, capacities)
    return state, result, tracker.body.skeleton.world_from_joint(result.pose)
