"""The pass that learns what stands in front of people: where the tracked body is missed, though others see it there.

Where it hides enough of the body, the frames in which it does are tracked again, and all that comes after knows it.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.errors import counted
from sogjax.io.frame_table import FramesRecord, FrameTable
from sogjax.io.npz_file import float_array, int_array, read_npz, save_npz
from sogjax.model.limbs import limb_blobs
from sogjax.model.program import compiled
from sogjax.run.frames import continued, rows_of
from sogjax.run.setup import Setup
from sogjax.run.terminal import progress, say
from sogjax.scene.foreground import TEMPER, own_color
from sogjax.scene.occluders import DepthCounts, HiddenFrom, cells_covered
from sogjax.search.placed_body import means_of
from sogjax.tracking.frame import FrameInput, TrackedFrame
from sogjax.tracking.tracker import Tracker
from sogjax.view.projection import picture_points

FILE = "occluders.npz"
LOOK_SECONDS = 0.15
"""Seconds between frames that are looked at."""
AGAIN_SECONDS, AGAIN_METRES = 0.3, 0.05
"""A blob counts again after so long, or so far away."""
COVERED = 0.9
"""Radius of what a blob covers for certain, in units of its size."""
WITNESSES = 3
"""Other cameras that must see a limb well where it is missed."""
WELL_SEEN, FOREGROUND = 0.6, 0.75
"""How far the cells of a limb must show its colours, as a part of how far they usually do, and be foreground."""
FEWEST_CELLS = 4
"""Of a limb in a camera that sees it."""
UNLIKE = 0.3
"""How much a blob may look like the empty scene (0 to 1) for a miss to tell."""
SIZES = 8192
"""Cells are compared in multiples of so many."""
MATTERS = 0.02
"""Part of the body's cells, in all cameras, that must be hidden in a frame for it to be tracked again."""
LEAST_ROWS = 0.05
"""Part of the frames in which that must be so for anything to be tracked again."""
SETTLED = 0.02
"""Metres between a body tracked again and as it was tracked, from which on the rest of the clip stays."""


@dataclass(frozen=True)
class LearntOccluders:
    """What stands in front, as far as that matters; None: nothing that does."""

    hidden: HiddenFrom | None
    rows: tuple[int, int] = (0, 0)
    """The first and the last row of the frames in which it hides a part of the body."""

    def in_setup(self, setup: Setup) -> Setup:
        """The setup whose tracker knows it."""
        if self.hidden is None:
            return setup
        tracker = setup.tracker
        return replace(setup, tracker=replace(tracker, reader=tracker.reader.behind(self.hidden)))

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder."""
        arrays = {"rows": np.array(self.rows)}
        save_npz(folder / FILE, arrays if self.hidden is None else arrays | {"hidden": self.hidden})

    @classmethod
    def load(cls, folder: Path) -> "LearntOccluders | None":
        """What was kept, if it was.

        Raises:
            InputError: what was kept does not fit together.
        """
        path = folder / FILE
        if not path.is_file():
            return None
        arrays = read_npz(path)
        first, last = int_array(path, arrays, "rows", (2,)).tolist()
        hidden = float_array(path, arrays, "hidden", (None, None, None)) if "hidden" in arrays else None
        return cls(hidden, (first, last))


class Retracked(FramesRecord):
    """The frames, those in which something hides the body tracked again."""

    file = "retracked.npz"


class _Covered(NamedTuple):
    """The cells that the body covers in one frame."""

    blob: Int[np.ndarray, "camera rows columns"]
    """The nearest one; -1 where there is none."""
    depth: Float[np.ndarray, "camera rows columns"]


def learn_occluders(setup: Setup, tracked: FrameTable) -> LearntOccluders:
    """What stands in front, from the frames as they were tracked.

    Raises:
        InputError: a video cannot be read.
    """
    tracker, clip = setup.tracker, setup.clip
    if tracker.reader.background is None or len(clip.grids) <= WITNESSES:
        return LearntOccluders(None)
    rows = range(0, len(tracked), max(round(LOOK_SECONDS * clip.fps), 1))
    numbers = clip.numbers
    frames = clip.frames(numbers[0], numbers[-1] + 1 if numbers.step > 0 else numbers[-1] - 1, numbers.step * rows.step)
    look = Look(setup, tracked.pose[rows.start : rows.stop : rows.step], rows.step / clip.fps)
    for at, frame in enumerate(progress(frames, len(rows), "looking for what stands in front")):
        look.add(at, frame)
    hidden = look.counts.hidden_from()
    shares = np.array([look.hidden_share(at, hidden) for at in range(len(rows))])
    matter = np.flatnonzero(shares > MATTERS)
    if len(matter) < max(LEAST_ROWS * len(rows), 2):
        return LearntOccluders(None)
    between = rows.step - 1  # frames that were not looked at are like their neighbours
    first, last = max(rows[matter[0]] - between, 0), min(rows[matter[-1]] + between, len(tracked) - 1)
    cameras = [name for name, of in zip(clip.recording.rig.names, hidden, strict=True) if np.isfinite(of).any()]
    say(
        f"something stands in front of {', '.join(cameras)} and hides up to {shares.max():.0%} of the body: frames "
        f"{numbers[first]} to {numbers[last]} are tracked again with it, and it is drawn in occluders.png"
    )
    return LearntOccluders(hidden, (first, last))


class Look:
    """Looks at frames, one after the other, of which the poses are known; `seconds` are those between them."""

    def __init__(self, setup: Setup, poses: Float[np.ndarray, "look dof"], seconds: float) -> None:
        self.seconds = seconds
        self.tracker, self.grids, body = setup.tracker, setup.clip.grids, setup.tracker.body
        self.means = means_of(body, poses).astype(float)
        rig = setup.clip.recording.rig
        self.pixels, self.depths = picture_points(rig, self.means)
        self.focal = [float(rig.camera(name).focal_length) for name in rig.names]
        self.sigmas = np.asarray(body.blob_sigmas, float)
        background = self.tracker.reader.background
        assert background is not None
        self.known = np.asarray(background.known)
        near = self.depths[self.depths > 0.1]
        self.counts = DepthCounts.empty(self.known.shape, float(near.min(initial=1.0)), float(near.max(initial=1.0)))
        plate = np.stack([np.asarray(plane) for plane in background.planes], axis=-1)
        self.plate, self.colors = plate, np.asarray(body.blob_colors)
        members = limb_blobs(body)
        trunk = (1 + len(members)) * np.asarray(body.blob_actors)
        self.limbs = np.where(members.any(axis=0), members.argmax(axis=0) if len(members) else 0, len(members) + trunk)
        self._scores: list[Float[np.ndarray, "camera limb"]] = []
        self._counted_at = np.full(len(self.sigmas), -np.inf)
        self._counted_place = np.full((len(self.sigmas), 3), np.inf)

    def covered(self, at: int) -> _Covered:
        """The cells that the body covers in a look."""
        shape, found = self.known.shape[1:], []
        for k, grid in enumerate(self.grids):
            depths = self.depths[k, at]
            radii = COVERED * self.sigmas * self.focal[k] / np.maximum(depths, 0.1) / grid.cell_size
            found.append(cells_covered((self.pixels[k, at] + 0.5) / grid.cell_size - 0.5, radii, depths, shape))
        blob = np.stack(found)
        depth = self.depths[:, at][np.arange(len(blob))[:, None, None], np.maximum(blob, 0)]
        return _Covered(blob, np.where(blob >= 0, depth, np.inf))

    def add(self, at: int, frame: FrameInput) -> None:
        """Count what is seen and what is missed in a look."""
        covered, odds = self.covered(at), np.asarray(_odds(self.tracker, jnp.asarray(frame.cells)))
        present = np.ones(len(self.grids), bool) if frame.present is None else np.asarray(frame.present)
        cells = np.nonzero((covered.blob >= 0) & self.known & present[:, None, None])
        blob, foreground = covered.blob[cells], 1.0 / (1.0 + np.exp(-odds[cells] / TEMPER))
        colors, own = np.asarray(frame.cells)[cells] / np.float32(255.0), self.colors[blob]
        witnessed = self._witnessed(cells[0], self.limbs[blob], foreground, _alike(colors, own))
        again = at * self.seconds - self._counted_at >= AGAIN_SECONDS - 1e-6
        again |= np.linalg.norm(self.means[at] - self._counted_place, axis=1) >= AGAIN_METRES
        self._counted_at[again], self._counted_place[again] = at * self.seconds, self.means[at][again]
        counts = witnessed & again[blob] & (_alike(self.plate[cells], own) < UNLIKE)
        camera, row, column = (part[counts] for part in cells)
        self.counts.add((camera, row, column), covered.depth[cells][counts], foreground[counts])

    def _witnessed(
        self,
        camera: Int[np.ndarray, "n"],
        limb: Int[np.ndarray, "n"],
        foreground: Float[np.ndarray, "n"],
        alike: Float[np.ndarray, "n"],
    ) -> Bool[np.ndarray, "n"]:
        """Which cells are of limbs that enough other cameras see well, as limbs of this clip are seen."""
        shape = (len(self.grids), int(self.limbs.max()) + 1)
        of_limbs = lambda values: np.bincount(camera * shape[1] + limb, values, shape[0] * shape[1]).reshape(shape)
        count = of_limbs(np.ones(len(limb)))
        enough = count >= FEWEST_CELLS
        count = np.where(enough, count, np.nan)
        score, shown = of_limbs(foreground * alike) / count, of_limbs(foreground) / count
        self._scores.append(score)
        scores = np.stack(self._scores).reshape(-1, shape[1])
        usual = np.array([np.percentile(of[np.isfinite(of)], 75) if np.isfinite(of).any() else 0.0 for of in scores.T])
        usual = np.maximum(usual, np.median(scores[np.isfinite(scores)]) if np.isfinite(scores).any() else 0.0)
        sees = enough & (score >= WELL_SEEN * usual[None]) & (shown >= FOREGROUND)
        others = sees.sum(axis=0)[None] - sees
        return others[camera, limb] >= WITNESSES

    def hidden_share(self, at: int, hidden: HiddenFrom) -> float:
        """Part of the cells that the body covers in a look that are hidden."""
        covered = self.covered(at)
        total = (covered.blob >= 0).sum()
        return float(((covered.blob >= 0) & (covered.depth >= hidden)).sum() / max(total, 1))


def _alike(colors: Float[np.ndarray, "n 3"], own: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
    """`own_color`, padded to a multiple so that few programs are compiled."""
    size = -len(colors) % SIZES
    padded = (jnp.asarray(np.pad(part, ((0, size), (0, 0)))) for part in (colors, own))
    return np.asarray(_own_color(*padded))[: len(colors)]


_own_color = compiled(own_color)


@compiled
def _odds(tracker: Tracker, cells: Array) -> Array:
    odds = tracker.reader.odds(cells.astype(tracker.cameras.intrinsics.dtype) / 255.0)
    assert odds is not None
    return odds


def track_again(setup: Setup, tracked: FrameTable, occluders: LearntOccluders) -> Retracked:
    """The frames, those tracked again in which something hides the body, and those after them that differ then.

    Raises:
        InputError: a video cannot be read, or a picture has too many image blobs.
    """
    first, last = occluders.rows
    numbers = setup.clip.numbers
    table = tracked
    if table.limb_doubt is not None:
        table = replace(tracked, limb_hidden=np.zeros_like(table.limb_doubt))
    known = tracked[:first] if first else None
    stop = numbers[-1] + (1 if numbers.step > 0 else -1)
    frames = setup.clip.frames(numbers[first], stop, numbers.step)
    coming = continued(setup.tracker, tracked.pose[first], known, frames, shown=False, with_images=False)
    found: list[TrackedFrame] = []
    for row, done in zip(
        range(first, len(tracked)), progress(coming, last + 1 - first, "tracking again"), strict=False
    ):
        found.append(done)
        if row > last and _apart(setup, done, tracked.pose[row]) < SETTLED:
            break
    say(f"{counted(len(found), 'frame')} tracked again")
    rows = rows_of(found, [numbers[row] for row in range(first, first + len(found))])
    parts = [table[:first], rows, table[first + len(found) :]]
    return Retracked(FrameTable.joined([part for part in parts if len(part)]))


def _apart(setup: Setup, done: TrackedFrame, pose: Float[np.ndarray, "dof"]) -> float:
    means = means_of(setup.tracker.body, np.stack([np.asarray(done.result.pose), pose]))
    return float(np.linalg.norm(means[0] - means[1], axis=-1).max())
