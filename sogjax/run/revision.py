"""A run told both ways: what was kept of it is revised where a backward pass explains the body better."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from sogjax.errors import InputError, counted
from sogjax.run.backwards import frames_backwards
from sogjax.run.job import Job
from sogjax.run.prefix import JUDGEMENT, TERM, Prefix
from sogjax.run.terminal import alive, say
from sogjax.search.backward_pass import Pass
from sogjax.search.merge_passes import Revised, in_doubt, merge_passes
from sogjax.settings.method import ImagesConfig
from sogjax.tracking.frame import FrameInput


@dataclass(frozen=True)
class Reviser:
    """Revises the frames of a job once all are tracked."""

    job: Job
    images: ImagesConfig

    def __call__(self, tracked: Prefix) -> Prefix | None:
        """The frames with what was revised; None where nothing was, or the pass backwards failed, which is said."""
        rows, job = tracked.rows, self.job
        if "limb_doubt" not in rows:
            return None
        energy = float(np.abs(rows["energy"]).mean())
        passed = Pass(rows["pose"], rows["limb_doubt"], rows["limb_usual"], energy, tracked.most_capacities)
        doubtful = int(in_doubt(passed).sum())
        if doubtful:
            say(f"limbs in doubt in {counted(doubtful, 'frame')}: tracked backwards around them, too")
        try:
            with alive("tracking backwards"):
                found = merge_passes(job.tracker, passed, self._backwards)
        except InputError as error:
            say(f"warning: not told both ways, the first pass stays as it is: {error}")
            return None
        if not found.frames:
            return None
        parts = ", ".join(f"{name} ({len(taken)})" for name, taken in sorted(found.parts.items()))
        say(f"taken from the backward pass in {counted(len(found.frames), 'frame')}: {parts}")
        return Prefix(_revised(rows, found.frames))

    def _backwards(self, begin: int, stop: int) -> Iterable[FrameInput]:
        """The cells of some rows, the last one first."""
        begin, stop = self.job.frames[0] + begin, self.job.frames[0] + stop
        frames = frames_backwards(self.job.recording, self.job.grids, self.images, begin, stop)
        return self.job.with_keypoints(frames, range(stop - 1, begin - 1, -1))


def _revised(rows: dict[str, np.ndarray], frames: dict[int, Revised]) -> dict[str, np.ndarray]:
    """The rows with what was found for some frames."""
    changed = {name: np.array(column) for name, column in rows.items()}
    for row, found in frames.items():
        changed["pose"][row], changed["energy"][row] = found.pose, found.energy
        for name in ("limb_doubt", "explained", "overlap"):
            changed[name][row] = getattr(found.judged, JUDGEMENT[name])
        for name, value in found.terms.items():
            changed[TERM + name][row] = value
    return changed
