"""Adjusting a clip: the shape from frames that tell it, poses of all frames in windows that overlap, then cameras."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.model.body import Body
from sogjax.model.program import compiled
from sogjax.model.rotation import axis_vector
from sogjax.refine.camera_moves import MOVE, velocities_of
from sogjax.refine.camera_search import FoundCameras, Part, found_cameras
from sogjax.refine.climb import Climbed, climbed
from sogjax.refine.clip_energy import ClipEnergy, Weights
from sogjax.refine.clip_priors import floor_height, step_of, undersides
from sogjax.refine.clip_shape import ClipShape, frames_by_spread
from sogjax.refine.pictures import ClipPictures
from sogjax.tracking.tracker import Tracker

SHAPE_FRAMES = 60
"""Frames of a long clip from which the shape is taken."""
OVERLAP = 8
"""Frames at the end of a window that the next one does again, since what follows them was not known."""
FIXED = 2
"""Frames at the beginning of a window that stay: those that the smoothness of the others looks at."""

Pictures = Callable[[Int[np.ndarray, "row"], Float[np.ndarray, "row dof"]], ClipPictures]
"""The pictures of some rows of a motion, near given poses."""
Report = Callable[[str], None]


@dataclass(frozen=True)
class Adjustment:
    """An adjusted clip."""

    poses: Float[np.ndarray, "frame dof"]
    params: Float[np.ndarray, "shape"]
    body: Body
    """The body with these shape parameters, upright in the recording's world."""
    before: float
    """Energy of the clip, the mean over the frames."""
    after: float
    shape_frames: Int[np.ndarray, "chosen"]
    """Rows of the motion that told the shape."""
    iterations: int
    values: dict[str, Float[np.ndarray, "frame"]]
    """Values of each term of tracking in every frame, without its weight and without a history."""
    capacity: int
    """Capacity for image blobs: how many a picture had at most, and then some."""
    moves: Float[np.ndarray, "camera 7"]
    """Moves of the cameras, as `camera_moves` has them."""
    told: dict[Part, float]
    """The moves that the clip told, and what each is worth as a share of what its camera could gain at most."""


def adjusted(
    tracker: Tracker,
    pictures: Pictures,
    poses: Float[np.ndarray, "frame dof"],
    frames: Int[np.ndarray, "frame"],
    similarity: Float[np.ndarray, "frame"],
    fps: float,
    up: str,
    window: int,
    weights: Weights | None = None,
    with_shape: bool = True,
    report: Report = lambda _: None,
    moves: Float[np.ndarray, "camera 7"] | None = None,
    in_question: tuple[str, ...] = (),
) -> Adjustment:
    """Poses and shape of highest energy near a tracked motion.

    Args:
        tracker: of the recording, with the body that was tracked.
        pictures: reads those of some rows.
        poses: tracked.
        frames: their numbers.
        similarity: of each frame as tracked, NaN where it is not known.
        fps: frames per second, of their numbers.
        up: the world's vertical.
        window: frames that are adjusted together; so many frames' pictures are kept in memory.
        weights: of the parts of the energy; None: the usual.
        with_shape: whether the shape is adjusted; else it stays.
        report: is told of the stages.
        moves: of the cameras, known before; None: they stand and see as the recording says.
        in_question: parts of the moves that the clip is asked for: turn, place, time.
    """
    shape = ClipShape.from_body(tracker.body, up)
    poses, params = np.array(poses, float), np.zeros(shape.num_params)
    vertical, frames = axis_vector(up), np.asarray(frames, int)
    floor = _floor(tracker.body, poses, vertical)
    moves = np.zeros((len(tracker.normalizers), MOVE)) if moves is None else moves
    clip = _Clip(tracker, shape, _kept(pictures), poses.copy(), frames, fps, vertical, weights or Weights(), floor)
    chosen = np.arange(len(poses))
    if with_shape and len(poses) > window:
        chosen = frames_by_spread(tracker.body.skeleton, poses, similarity, min(SHAPE_FRAMES, window))
        report(f"shape, from {len(chosen)} frames")
        found = clip.climbed(chosen, _Stand(poses, params, moves), True)
        poses[chosen], params = found.poses, clip.of_shape(found.params)
    stand, parts = clip.through(_Stand(poses, params, moves), window, with_shape, report)
    told: dict[Part, float] = {}
    if in_question:
        report("cameras")
        rows = chosen if len(chosen) <= window else np.linspace(0, len(poses) - 1, window).astype(int)
        cameras = clip.cameras(rows, stand, with_shape and len(poses) <= window, in_question, report)
        if cameras is not None:
            told = cameras.shares
            stand = replace(stand, params=clip.of_shape(cameras.climbed.params), moves=cameras.moves)
            stand.poses[rows] = cameras.climbed.poses
            stand, parts = clip.through(stand, window, with_shape, report)
    values = {name: np.zeros(len(poses)) for name in parts[0][1].values}
    for rows, part in parts:
        for name, value in part.values.items():
            values[name][rows] = value
    total = sum(len(rows) for rows, _ in parts)
    return Adjustment(
        stand.poses,
        stand.params,
        shape.shaped(jnp.asarray(stand.params, jnp.float32)),
        sum(part.before for _, part in parts) / total,
        sum(part.after for _, part in parts) / total,
        chosen,
        sum(part.iterations for _, part in parts),
        values,
        max(part.capacity for _, part in parts),
        stand.moves,
        told,
    )


@dataclass(frozen=True)
class _Stand:
    """How far the adjustment is."""

    poses: Float[np.ndarray, "frame dof"]
    params: Float[np.ndarray, "shape"]
    moves: Float[np.ndarray, "camera 7"]


@dataclass(frozen=True)
class _Clip:
    """What is the same for all windows of a clip."""

    tracker: Tracker
    shape: ClipShape
    pictures: Pictures
    tracked: Float[np.ndarray, "frame dof"]
    frames: Int[np.ndarray, "frame"]
    fps: float
    vertical: Float[np.ndarray, "3"]
    weights: Weights
    floor: float

    def through(
        self, stand: _Stand, window: int, with_shape: bool, report: Report
    ) -> tuple[_Stand, list[tuple[Int[np.ndarray, "row"], Climbed]]]:
        """All frames climbed, in windows where they are many: then the shape stays."""
        poses, params, parts = stand.poses.copy(), stand.params, []
        for rows, held in _windows(len(poses), window):
            whole = len(rows) == len(poses)
            frames = f"frames {self.frames[rows[0]]} to {self.frames[rows[-1]]}"
            report(("poses and shape" if with_shape else "poses") if whole else f"poses of {frames}")
            found = self.climbed(rows, _Stand(poses, params, stand.moves), with_shape and whole, held)
            poses[rows], params = found.poses, self.of_shape(found.params)
            parts.append((rows, found))
        return _Stand(poses, params, stand.moves), parts

    def climbed(
        self,
        rows: Int[np.ndarray, "row"],
        stand: _Stand,
        with_shape: bool,
        held: Bool[np.ndarray, "row"] | None = None,
    ) -> Climbed:
        """Some frames climbed; the energy before is that of the motion as it was tracked."""
        energy = self._energy(rows, stand, bool(stand.moves.any()))
        start = self.tracked[rows], np.zeros(energy.num_shared)
        free = (np.arange(energy.num_shared) < self.shape.num_params) & with_shape
        return climbed(energy, stand.poses[rows], self._shared(energy, stand), free, held, start)

    def cameras(
        self,
        rows: Int[np.ndarray, "row"],
        stand: _Stand,
        with_shape: bool,
        in_question: tuple[str, ...],
        report: Report,
    ) -> FoundCameras | None:
        """What some frames tell of the cameras."""
        energy = self._energy(rows, stand, True)
        return found_cameras(energy, stand.poses[rows], self._shared(energy, stand), with_shape, in_question, report)

    def of_shape(self, shared: Float[np.ndarray, "shared"]) -> Float[np.ndarray, "shape"]:
        """The shape parameters among those that all frames share."""
        return shared[: self.shape.num_params]

    def _shared(self, energy: ClipEnergy, stand: _Stand) -> Float[np.ndarray, "shared"]:
        return np.concatenate([stand.params, stand.moves.reshape(-1)])[: energy.num_shared]

    def _energy(self, rows: Int[np.ndarray, "row"], stand: _Stand, cameras_move: bool) -> ClipEnergy:
        """The energy of some frames, whose blobs move as in the whole motion."""
        velocities = None
        if cameras_move:
            body = self.shape.shaped(jnp.asarray(stand.params, jnp.float32))
            means = np.asarray(_means(body, jnp.asarray(stand.poses, jnp.float32)), float)
            velocities = velocities_of(means, self.frames)[rows]
        return ClipEnergy(
            self.tracker, self.shape, self.pictures(rows, stand.poses[rows]), self.frames[rows], self.fps,
            step_of(self.frames), self.vertical, self.weights, self.floor, velocities=velocities,
        )  # fmt: skip


def _kept(pictures: Pictures) -> Pictures:
    """The pictures of the rows that were asked for last are not read again: poses have hardly moved since."""
    last: list[tuple[np.ndarray, ClipPictures]] = []

    def read(rows: Int[np.ndarray, "row"], poses: Float[np.ndarray, "row dof"]) -> ClipPictures:
        if not (last and np.array_equal(last[0][0], rows)):
            last.clear()
            last.append((rows, pictures(rows, poses)))
        return last[0][1]

    return read


def _windows(count: int, window: int) -> Iterator[tuple[Int[np.ndarray, "row"], Bool[np.ndarray, "row"]]]:
    """The rows of every window, and which of them stay."""
    first = 0
    while True:
        last = min(first + window, count)
        rows = np.arange(first, last)
        yield rows, (rows < first + FIXED) & (first > 0)
        if last == count:
            return
        first = last - OVERLAP - FIXED


def _floor(body: Body, poses: Float[np.ndarray, "frame dof"], vertical: Float[np.ndarray, "3"]) -> float:
    """Where the floor is, as tracked."""
    means = np.asarray(_means(body, jnp.asarray(poses, jnp.float32)), float)
    return floor_height(undersides(means, np.asarray(body.blob_sigmas, float), vertical))


_means = compiled(lambda body, poses: jax.lax.map(lambda pose: body.posed_blobs(pose).means, poses))
