"""Both ways: where limbs are in doubt, a clip is tracked backwards, too, and each limb is taken from the better pass.

A limb that is lost is often found again by itself. Backwards from there it is followed into the frames where it was
lost: what hid it, or moved too far for one frame, comes from the other side.
"""

from dataclasses import dataclass, field, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.quality.metrics import stretches
from sogjax.search.backward_pass import SURE_FRAMES, FramesBackwards, Pass, compared_backwards
from sogjax.search.body_parts import body_parts, merged_pose, select_parts
from sogjax.tracking.capacity import Needed, with_room
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import AnyFrame, FrameInput, TrackState, on_device
from sogjax.tracking.tracker import Tracker

MOST_LOOKS = 2
"""Frames that are tracked backwards, at most, in lengths of the clip."""


@dataclass(frozen=True)
class Revised:
    """What holds for a frame of which some part comes from the other pass."""

    pose: Float[np.ndarray, "dof"]
    energy: float
    terms: dict[str, float]
    judged: LimbConfidence


@dataclass
class Revision:
    """Frames that were revised, and in which of them each part of the body was taken from the other pass."""

    frames: dict[int, Revised] = field(default_factory=dict)
    parts: dict[str, set[int]] = field(default_factory=dict)


def in_doubt(passed: Pass) -> Bool[np.ndarray, "frame"]:
    """The frames around which a clip is tracked backwards."""
    return passed.doubts.max(axis=1, initial=0.0) > fitted_numbers().merge_passes.doubtful


def merge_passes(tracker: Tracker, passed: Pass, frames: FramesBackwards) -> Revision:
    """Where another pass explains parts of the body better, among the frames around those that are in doubt.

    `frames` reads cells backwards, by rows of `passed`; the tracker must judge limbs.
    """
    revising = _Revising(tracker, replace(passed, poses=passed.poses.copy(), doubts=passed.doubts.copy()), frames)
    while (stretch := revising.next_stretch()) is not None:
        revising.look_at(*stretch)
    return revising.revision


class _Revising:
    """A pass while it is revised, one stretch after the other, the last one first."""

    def __init__(self, tracker: Tracker, passed: Pass, frames: FramesBackwards) -> None:
        self.tracker, self.passed, self.frames = tracker, passed, frames
        self.parts, self.revision = body_parts(tracker.body), Revision()
        self._tried: set[int] = set()
        self._looked_at = 0

    def next_stretch(self) -> tuple[int, int] | None:
        """First and last frame of the last stretch in doubt from behind which no pass has begun."""
        if self._looked_at > MOST_LOOKS * len(self.passed.poses):
            return None
        found = [(first, stop - 1) for first, stop in stretches(in_doubt(self.passed), gap=SURE_FRAMES)]
        left = [stretch for stretch in found if stretch[1] not in self._tried]
        return left[-1] if left else None

    def look_at(self, first: int, last: int) -> None:
        """Track backwards from behind a stretch, and revise what the pass explains better."""
        found, begin = compared_backwards(self.tracker, self.passed, self.frames, self.parts, first, last)
        rows = begin - 1 - np.arange(len(found.poses))
        ends = (begin == len(self.passed.poses), bool(rows[-1] == 0))
        taken = select_parts(self.parts, np.stack(found.apart), np.stack(found.gains), self.passed.energy, ends)
        changed, poses = np.flatnonzero(taken.any(axis=1)), self.passed.poses
        for k in changed:
            poses[rows[k]] = merged_pose(self.tracker.body, self.parts, poses[rows[k]], found.poses[k], taken[k])
        for k in changed:
            self._value(int(rows[k]), found.cells[k])
        for part, of_part in zip(self.parts, taken.T, strict=True):
            if of_part.any():
                self.revision.parts.setdefault(part.name, set()).update(rows[of_part].tolist())
        self._tried.add(last)
        self._looked_at += len(rows)

    def _value(self, row: int, frame: AnyFrame) -> None:
        """Note what a revised pose is worth."""
        poses = self.passed.poses
        before, before_that = (jnp.asarray(poses[max(row - j, 0)]) for j in (1, 2))
        history = History(before, before_that, jnp.asarray(row >= 2))
        pose, baseline = jnp.asarray(poses[row]), jnp.asarray(self.passed.baseline[row])
        known, room = on_device(frame), self.passed.capacities
        value = with_room(lambda room: _valued(self.tracker, history, known, room, pose, baseline), room)
        energy, terms, judged = jax.device_get(value)
        self.passed.doubts[row] = judged.error_probability
        values = {name: float(term) for name, term in terms.items()}
        self.revision.frames[row] = Revised(poses[row].copy(), float(energy), values, judged)


@eqx.filter_jit
def _valued(
    tracker: Tracker,
    history: History,
    frame: FrameInput,
    capacities: Capacities,
    pose: Float[Array, "dof"],
    baseline: Float[Array, "2 blob"],
) -> tuple[tuple[Float[Array, ""], dict[str, Float[Array, ""]], LimbConfidence], Needed]:
    """Energy, terms and doubts of a pose that is known; and the room that they need."""
    views, near, matching = tracker.views(frame, TrackState.from_pose(pose), capacities)
    energy = FrameEnergy(tracker.body, views, history, tracker.terms)
    judged = tracker.judged(pose, baseline, views.windows, frame)
    return (energy(pose), energy.values(pose), judged), (jnp.max(near), jnp.max(matching))
