"""Repair while tracking: a limb in doubt is tried in other places, and stays where it explains the pictures better."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.model.body import Body
from sogjax.tracking.frame import FrameResult, TrackState
from sogjax.tracking.limbs import limb_blobs, limbs
from sogjax.tracking.mirrored import means_of, other_side

NUM_TRIED, NUM_CLIMBED = 96, 4
"""Poses of a limb that are judged, and of which the best are climbed."""
FRAMES_BEFORE = 5
"""How long ago the limb may have been in its place."""
DIFFERENT = 0.3
"""Radians, in some joint: limbs nearer to each other are one."""
DOUBTFUL, LESS_DOUBT = 0.5, 0.2
"""A limb is tried elsewhere above the one, and elsewhere it must be doubted less by the other."""
ENERGY_LOST = 0.01
"""Part of the energy that the other place may cost."""
LASTING = 3
"""Frames on end in which it must be better."""
PAUSE = 3
"""Frames after an attempt without success."""
NEAR_ROOT, INSIDE, MOST_INSIDE = 0.25, 0.7, 0.2
"""Part of a limb's blobs that may touch what it hangs on; of the sizes of two blobs, within which one is in the other;
part of the others that may be."""

Step = Callable[[TrackState], tuple[TrackState, FrameResult] | None]
"""The tracker's step from another state in the frame at hand; None: there is no room for what it needs."""
Judge = Callable[[TrackState, Float[Array, "try dof"]], Float[Array, "try limb"]]
"""The doubt about the limbs of some poses in the frame at hand."""


@dataclass(frozen=True)
class OnTrial:
    """A limb that is followed elsewhere, too."""

    limb: int
    state: TrackState
    frames: int
    """In which it has been better."""


class Repair:
    """Looks at every frame after its step; costs nothing where no limb is in doubt."""

    def __init__(self, body: Body) -> None:
        self._body, self._limbs, self._blobs = body, limbs(body.skeleton), limb_blobs(body)
        self._past: deque[np.ndarray] = deque(maxlen=FRAMES_BEFORE + 1)
        self._trial: OnTrial | None = None
        self._pause = 0
        self._random = np.random.default_rng(0)

    def after(
        self, before: TrackState, found: tuple[TrackState, FrameResult], step: Step, judge: Judge
    ) -> tuple[TrackState, FrameResult]:
        """What holds after a frame: what the step found from the state `before`, or that with a limb elsewhere."""
        if found[1].limbs is None:
            return found
        if self._trial is not None:
            found = self._tried_on(self._trial, found, step)
        self._past.append(np.asarray(found[1].pose))
        doubt = np.asarray(_doubt(found[1]))
        self._pause = max(self._pause - 1, 0)
        if self._trial is None and self._pause == 0 and doubt.max(initial=0.0) > DOUBTFUL:
            self._trial = self._begun(int(doubt.argmax()), before, found, step, judge)
            self._pause = 0 if self._trial else PAUSE
        return found

    def _tried_on(
        self, trial: OnTrial, found: tuple[TrackState, FrameResult], step: Step
    ) -> tuple[TrackState, FrameResult]:
        """The trial one frame later: given up, gone on with, or taken."""
        other = step(trial.state)
        self._trial = None
        if other is None or not _is_better(other[1], found[1], trial.limb):
            return found
        if trial.frames + 1 >= LASTING:
            return other
        self._trial = replace(trial, state=other[0], frames=trial.frames + 1)
        return found

    def _begun(
        self, limb: int, before: TrackState, found: tuple[TrackState, FrameResult], step: Step, judge: Judge
    ) -> OnTrial | None:
        """The best other place of a limb, if there is a better one."""
        pose = np.asarray(found[1].pose)
        tried = self._hypotheses(pose, limb)
        doubts = np.asarray(judge(before, jnp.asarray(tried)))[:, limb]
        best: tuple[TrackState, FrameResult] | None = None
        for chosen in self._different(tried, doubts, limb):
            start = jnp.asarray(tried[chosen])
            climbed = step(TrackState(start, start, jnp.asarray(0), before.usual))
            if climbed is None or not _is_better(climbed[1], found[1], limb):
                continue
            if best is None or _doubt(climbed[1])[limb] < _doubt(best[1])[limb]:
                best = climbed
        if best is None:
            return None
        moved = best[1].pose - found[1].pose  # the same velocity as that of the pose that was found
        state = TrackState(jnp.asarray(best[1].pose), before.previous + moved, jnp.asarray(2), best[0].usual)
        return OnTrial(limb, state, 1)

    def _hypotheses(self, pose: Float[np.ndarray, "dof"], limb: int) -> Float[np.ndarray, "try dof"]:
        """The pose with the limb as it was, as its counterpart is, as in named poses, and drawn within its limits."""
        dofs, skeleton = self._limbs[limb], self._body.skeleton
        ways = [self._past[0][dofs], pose[other_side(skeleton.dof_names)[dofs]]]
        ways += [np.asarray(named)[dofs] for named in self._body.poses.values()]
        count = max(NUM_TRIED - len(ways), 0)
        lower, upper = np.asarray(skeleton.dof_lower)[dofs], np.asarray(skeleton.dof_upper)[dofs]
        far = self._random.uniform(0.3, 1.0, (count, 1))
        drawn = (1.0 - far) * pose[dofs] + far * self._random.uniform(lower, upper, (count, len(dofs)))
        poses = np.tile(pose, (NUM_TRIED, 1)).astype(pose.dtype)
        poses[:, dofs] = np.concatenate([np.stack(ways), drawn])[:NUM_TRIED]
        free = ~self._intersects(poses, limb)
        return np.where(free[:, None], poses, pose[None])

    def _intersects(self, poses: Float[np.ndarray, "try dof"], limb: int) -> Bool[np.ndarray, "try"]:
        """Whether too much of a limb is inside of the rest of the body."""
        mine = np.flatnonzero(self._blobs[limb])
        outer, others = mine[int(np.ceil(NEAR_ROOT * len(mine))) :], np.flatnonzero(~self._blobs[limb])
        means, sigmas = means_of(self._body, poses), np.asarray(self._body.blob_sigmas)
        apart = np.linalg.norm(means[:, outer, None] - means[:, None, others], axis=-1)
        inside = apart < INSIDE * (sigmas[outer, None] + sigmas[None, others])
        return inside.any(axis=2).mean(axis=1) > MOST_INSIDE

    def _different(self, tried: Float[np.ndarray, "try dof"], doubts: Float[np.ndarray, "try"], limb: int) -> list[int]:
        """Those that are doubted least, no two of them nearly the same."""
        chosen: list[int] = []
        for k in np.argsort(doubts):
            apart = [np.abs(tried[k] - tried[other])[self._limbs[limb]].max() for other in chosen]
            if len(chosen) < NUM_CLIMBED and min(apart, default=np.inf) > DIFFERENT:
                chosen.append(int(k))
        return chosen


def _is_better(other: FrameResult, found: FrameResult, limb: int) -> bool:
    """Whether the limb is doubted clearly less and the energy is hardly lower."""
    bound = min(DOUBTFUL, float(_doubt(found)[limb]) - LESS_DOUBT)
    least = float(found.energy) - ENERGY_LOST * abs(float(found.energy))
    return float(_doubt(other)[limb]) < bound and float(other.energy) >= least


def _doubt(result: FrameResult) -> Float[Array, "limb"]:
    assert result.limbs is not None
    return result.limbs.doubt
