"""Adjusting a clip: the shape from frames that tell it, then the poses of all frames in windows that overlap."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.adjust.climb import Climbed, climbed
from sogjax.adjust.clip_energy import ClipEnergy, Weights
from sogjax.adjust.clip_shape import ClipShape
from sogjax.adjust.contact import floor_height, undersides
from sogjax.adjust.frame_choice import frames_by_spread
from sogjax.adjust.pictures import ClipPictures
from sogjax.model.body import Body
from sogjax.model.frames import axis_vector
from sogjax.tracking.tracker import Tracker

SHAPE_FRAMES = 60
"""Of a long clip, from which the shape is taken."""
OVERLAP = 8
"""Frames at the end of a window that the next one does again, since what follows them was not known."""
FIXED = 2
"""Frames at the beginning of a window that stay: those that the smoothness of the others looks at."""

Pictures = Callable[[Int[np.ndarray, "row"], Float[np.ndarray, "row dof"]], ClipPictures]
"""The pictures of some rows of a motion, near given poses."""
Report = Callable[[str], None]


@dataclass(frozen=True)
class Adjusted:
    """An adjusted clip."""

    poses: Float[np.ndarray, "frame dof"]
    params: Float[np.ndarray, "shape"]
    body: Body
    """With these shape parameters, upright in the recording's world."""
    before: float
    """Energy of the clip, the mean over the frames."""
    after: float
    shape_frames: Int[np.ndarray, "chosen"]
    """Rows of the motion that told the shape."""
    iterations: int
    values: dict[str, Float[np.ndarray, "frame"]]
    """Of each term of tracking in every frame, without its weight and without a history."""
    room: int
    """For image blobs: how many a picture had at most, and then some."""


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
) -> Adjusted:
    """Poses and shape of highest energy near a tracked motion.

    Args:
        tracker: of the recording, with the body that was tracked.
        pictures: reads those of some rows.
        poses: tracked.
        frames: their numbers.
        similarity: of each frame as tracked, NaN where it is not known.
        fps: frames per second.
        up: the world's vertical.
        window: frames that are adjusted together; so many frames' pictures are kept in memory.
        weights: of the parts of the energy; None: the usual.
        with_shape: whether the shape is adjusted; else it stays.
        report: is told of the stages.
    """
    shape = ClipShape.from_body(tracker.body, up)
    poses, params = np.array(poses, float), np.zeros(shape.num_params)
    vertical, frames = axis_vector(up), np.asarray(frames, int)
    floor = _floor(tracker.body, poses, vertical)
    clip = _Clip(tracker, shape, pictures, poses.copy(), frames, fps, vertical, weights or Weights(), floor)
    chosen = np.arange(len(poses))
    if len(poses) <= window:
        report("poses and shape" if with_shape else "poses")
        found = clip.climbed(chosen, poses, params, with_shape)
        parts, values = [found], found.values
        poses, params = found.poses, found.params
    else:
        parts, values = [], {}
        if with_shape:
            chosen = frames_by_spread(tracker.body.skeleton, poses, similarity, min(SHAPE_FRAMES, window))
            report(f"shape, from {len(chosen)} frames")
            found = clip.climbed(chosen, poses, params, True)
            poses[chosen], params = found.poses, found.params
        for rows, held in _windows(len(poses), window):
            report(f"poses of frames {frames[rows[0]]} to {frames[rows[-1]]}")
            found = clip.climbed(rows, poses, params, False, held)
            poses[rows] = found.poses
            parts.append(found)
            for name, value in found.values.items():
                values.setdefault(name, np.zeros(len(poses)))[rows] = value
    total = sum(len(part.poses) for part in parts)
    return Adjusted(
        poses,
        params,
        shape.shaped(jnp.asarray(params, jnp.float32)),
        sum(part.before for part in parts) / total,
        sum(part.after for part in parts) / total,
        chosen,
        sum(part.iterations for part in parts),
        values,
        max(part.room for part in parts),
    )


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

    def climbed(
        self,
        rows: Int[np.ndarray, "row"],
        poses: Float[np.ndarray, "frame dof"],
        params: Float[np.ndarray, "shape"],
        with_shape: bool,
        held: Bool[np.ndarray, "row"] | None = None,
    ) -> Climbed:
        """Some frames climbed; the energy before is that of the motion as it was tracked."""
        seen = self.pictures(rows, poses[rows])
        energy = ClipEnergy(
            self.tracker, self.shape, seen, self.frames[rows], self.fps, self.vertical, self.weights, self.floor
        )
        start = self.tracked[rows], np.zeros(self.shape.num_params)
        return climbed(energy, poses[rows], params, np.full(self.shape.num_params, with_shape), held, start)


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


_means = eqx.filter_jit(lambda body, poses: jax.lax.map(lambda pose: body.posed_blobs(pose).means, poses))
