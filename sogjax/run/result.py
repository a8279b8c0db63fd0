"""The result of a run, and a run in a few numbers."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int

from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.quality.evaluation import GroupEvaluation
from sogjax.quality.limb_warnings import doubtful_limbs
from sogjax.quality.metrics import summarize
from sogjax.quality.verdict import Verdict
from sogjax.run.clock import StageTimes


@dataclass
class RunResult:
    """A tracked recording and its motions."""

    recording: Recording
    bodies: tuple[Body, ...]
    """The actors, upright in the recording's world; none if the run had ended before."""
    motions: dict[str, Motion]
    times: StageTimes
    image_blobs: float
    """Image blobs that were used per frame and camera, on average; NaN if the run had ended before."""
    evaluation: GroupEvaluation | None = None
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    """What the run thinks of each actor's motion."""
    missing: dict[str, int] = field(default_factory=dict)
    """Frames of the motion in which a camera had no picture, by camera."""
    files: list[Path] = field(default_factory=list)

    @property
    def iterations(self) -> Int[np.ndarray, "frame"]:
        """Iterations of the solver, for all actors together."""
        return next(iter(self.motions.values())).iterations

    @property
    def converged(self) -> Bool[np.ndarray, "frame"]:
        """Whether the solver did, for all actors together."""
        return next(iter(self.motions.values())).converged


COLUMNS = (
    *("mean mm", "std mm", "joints mm", "lost", "swaps"),
    *("similarity", "explained %", "findings", "doubtful", "iterations", "not converged", "frames/s"),
)
OBJECTIVE = "mean mm"
"""What a searching sweeper minimises."""


class Numbers(dict[str, float]):
    """The numbers of a run; as one number, what a search minimises."""

    def __float__(self) -> float:
        return float(self[OBJECTIVE])


def row_numbers(result: RunResult) -> Numbers:
    """The numbers of a run."""
    numbers = Numbers(dict.fromkeys(COLUMNS, float("nan")))
    if result.evaluation is not None:
        summary = result.evaluation.summary
        numbers["mean mm"], numbers["std mm"] = 1000.0 * summary.mean, 1000.0 * summary.std
        joints = [e.joints.errors for e in result.evaluation.evaluations.values() if e.joints is not None]
        if joints:
            numbers["joints mm"] = 1000.0 * summarize(np.concatenate(joints, axis=1)).mean
        numbers["swaps"] = len(result.evaluation.swaps)
        numbers["lost"] = sum(len(e.lost) for e in result.evaluation.evaluations.values())
    numbers["similarity"] = _mean_similarity(result)
    explained = [verdict.explained for verdict in result.verdicts.values() if verdict.explained is not None]
    if explained:
        numbers["explained %"] = 100.0 * float(np.mean(explained))
    if result.verdicts:
        numbers["findings"] = sum(len(verdict.findings) for verdict in result.verdicts.values())
    numbers["doubtful"] = sum(len(doubtful_limbs(motion)) for motion in result.motions.values())
    numbers["iterations"] = float(np.mean(result.iterations))
    numbers["not converged"] = int(np.sum(~result.converged))
    numbers["frames/s"] = result.times.frames_per_second("step")
    return numbers


def _mean_similarity(result: RunResult) -> float:
    """Over the frames and actors where it was computed."""
    values = np.concatenate([np.asarray(motion.similarity, float) for motion in result.motions.values()])
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else float("nan")
