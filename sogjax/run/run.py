"""The result of tracking a recording."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Int

from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.quality.evaluation import GroupEvaluation
from sogjax.quality.verdict import Verdict
from sogjax.run.clock import StageTimes


@dataclass
class Run:
    """A tracked recording and its motions."""

    recording: Recording
    bodies: list[Body]
    """The actors, upright in the recording's world; none if the run had ended before."""
    motions: dict[str, Motion]
    times: StageTimes
    image_blobs: float
    """Used per frame and camera, on average."""
    evaluation: GroupEvaluation | None = None
    verdicts: dict[str, Verdict] = field(default_factory=dict)
    """What the run thinks of each actor's motion."""
    missing: dict[str, int] = field(default_factory=dict)
    """Frames of the motion in which a camera had no picture, by camera."""
    files: list[Path] = field(default_factory=list)

    @property
    def iterations(self) -> Int[np.ndarray, "frame"]:
        """Of the solver, for all actors together."""
        return next(iter(self.motions.values())).iterations

    @property
    def converged(self) -> Bool[np.ndarray, "frame"]:
        """Whether the solver did, for all actors together."""
        return next(iter(self.motions.values())).converged
