"""What the energy thinks of the truth: optima reached from tracked and from true poses, frame by frame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, UInt8

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.background import learn_background
from sogjax.run.setup import tracking_setup
from sogjax.run.track import opened_clip
from sogjax.settings.run import TrackConfig
from sogjax.tracking.capacity import first_capacities, larger_capacities
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, TrackState
from sogjax.tracking.solving import solve_near
from sogjax.tracking.tracker import Tracker

Poses = Float[np.ndarray, "frame dof"]
Values = Float[np.ndarray, "frame"]


@dataclass(frozen=True)
class Climbed:
    """The optima that were reached from poses, frame by frame; NaN where there was none to start from."""

    poses: Poses
    parts: Mapping[str, Values]
    """What each term adds to the energy, with its weight and sign."""

    @property
    def energy(self) -> Values:
        """The sum of the parts."""
        return np.sum(list(self.parts.values()), axis=0)


@dataclass(frozen=True)
class Pair:
    """The optima reached from the tracked and from the true poses, in the same pictures."""

    tracked: Climbed
    true: Climbed


def ranked(
    recording: Recording,
    bodies: list[Body],
    config: TrackConfig,
    frames: Int[np.ndarray, "frame"],
    starts: list[Poses],
    every: int = 1,
) -> Pair:
    """Climb from tracked and from true poses with the solver and the energy of a config.

    Either path has its own history: the acceleration penalty is that of its own optima, or of the poses that it starts
    from where frames are left out. The pictures are culled around both poses.

    Args:
        recording: in which was tracked.
        bodies: the actors, in their own upright frames.
        config: of the track; its initial pose is not used.
        frames: counted from the recording's first, one after the other.
        starts: the tracked and the true poses of all actors beside each other; NaN where not known.
        every: of how many of these frames one is climbed in.
    """
    tracked, true = starts
    clip = opened_clip(recording, config)
    background = learn_background(clip, config.images.background, config.images.cache)
    tracker = tracking_setup(clip, background, bodies, config).tracker
    first = recording.first_frame + int(frames[0])
    climber = _Climber(tracker)
    paths: list[list[_Optimum | None]] = [[], []]
    rows = range(0, len(frames), every)
    for k, seen in zip(rows, clip.frames(first, first + len(frames), every), strict=True):
        for path, poses in zip(paths, starts, strict=True):
            known = np.isfinite(poses[k]).all() and np.isfinite(true[k]).all()
            optima = [None if one is None else one.pose for one in path[-2:]]
            before = optima if every == 1 else [*poses[max(k - 2, 0) : k]]
            around = (tracked[k], true[k])
            path.append(climber.climb(np.asarray(seen.cells), around, poses[k], before) if known else None)
    return Pair(*(_joined(path, tracker) for path in paths))


@dataclass(frozen=True)
class _Optimum:
    pose: Float[Array, "dof"]
    parts: dict[str, Array]


class _Climber:
    """A tracker's solver, from any pose of any frame."""

    def __init__(self, tracker: Tracker) -> None:
        self.tracker = replace(tracker, reader=replace(tracker.reader, box_around="predicted"), extrapolation=1.0)
        self.capacities: Capacities | None = None

    def climb(
        self,
        cells: UInt8[np.ndarray, "camera rows columns 3"],
        around: Sequence[Float[np.ndarray, "dof"]],
        start: Float[np.ndarray, "dof"],
        before: Sequence[Float[np.ndarray | Array, "dof"] | None],
    ) -> _Optimum:
        """The optimum above a pose, in pictures culled around two poses, after the poses of the frames before."""
        dtype = self.tracker.body.skeleton.offsets.dtype
        last, predicted, pose = (jnp.asarray(each, dtype) for each in (*around, start))
        seen_from = TrackState(last, 2.0 * last - predicted, jnp.asarray(0))
        seen_cells = jnp.asarray(cells)
        if self.capacities is None:
            self.capacities = first_capacities(self.tracker, seen_from, FrameInput(seen_cells))
        while True:
            capacities = self.capacities
            found, parts, counts = _climbed(
                self.tracker, seen_cells, seen_from, _history(before, pose), pose, capacities
            )
            near, matching, blocks = (int(np.max(count)) for count in jax.device_get(counts))
            if capacities.hold(near, matching, blocks):
                return _Optimum(found, parts)
            self.capacities = larger_capacities(capacities, near, matching, blocks)


@eqx.filter_jit
def _climbed(
    tracker: Tracker,
    cells: UInt8[Array, "camera rows columns 3"],
    seen_from: TrackState,
    history: History,
    start: Float[Array, "dof"],
    capacities: Capacities,
) -> tuple[Float[Array, "dof"], dict[str, Array], tuple[Array, Array, Array]]:
    views, near, matching = tracker.views(FrameInput(cells), seen_from, capacities)
    objective = FrameEnergy(tracker.body, views, history, tracker.terms)
    if tracker.pairs == "sparse":
        solution, blocks = solve_near(tracker.solver, objective, start, tracker.scales, capacities.blocks)
    else:
        solution, blocks = tracker.solver.maximize(objective, start, tracker.scales), jnp.asarray(0)
    values = objective.values(solution.params)
    parts = {term.name: term.signed_weight * values[term.name] for term in tracker.terms}
    return solution.params, parts, (near, matching, blocks)


def _history(before: Sequence[Float[np.ndarray | Array, "dof"] | None], pose: Float[Array, "dof"]) -> History:
    two = [jnp.asarray(each, pose.dtype) for each in before if each is not None and np.isfinite(each).all()]
    return History(two[1], two[0], jnp.asarray(True)) if len(two) == 2 else History.unknown(pose)


def _joined(path: Sequence[_Optimum | None], tracker: Tracker) -> Climbed:
    unknown = np.full(tracker.body.skeleton.num_dofs, np.nan)
    names = [term.name for term in tracker.terms]
    return Climbed(
        np.stack([unknown if one is None else np.asarray(one.pose, float) for one in path]),
        {name: np.array([np.nan if one is None else float(one.parts[name]) for one in path]) for name in names},
    )
