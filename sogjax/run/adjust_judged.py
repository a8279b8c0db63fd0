"""What the cameras say of an adjusted clip, and whether its actor's new colours stay."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import tee

import numpy as np

from sogjax.io.motion import Motion
from sogjax.model.body import Body
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.run.job import Job
from sogjax.run.judged_frames import Judged
from sogjax.run.prefix import JUDGEMENT, Prefix
from sogjax.tracking.frame import FrameInput
from sogjax.tracking.known_poses import confidence_of_poses

MORE_DOUBT = 0.02
"""About a limb, on average over the frames, that new colours may cause."""


def judged_with_colors(
    job: Job, body: Body, cells: Iterable[FrameInput], prefix: Prefix, motion: Motion
) -> tuple[Job, Prefix, Motion]:
    """The job with a body of new colours, unless these make a limb more doubtful; and what is said of the poses.

    Args:
        job: of the adjusted body.
        body: with new colours, or the same.
        cells: of the motion's frames, read once.
        prefix: its frames.
        motion: the adjusted poses.
    """
    jobs = [job]
    if body is not job.bodies[0]:
        jobs.append(replace(job, bodies=[body], tracker=replace(job.tracker, body=body)))
    judgements = _judgements(jobs, cells, motion)
    told = [(each, *_told(each, found, prefix, motion)) for each, found in zip(jobs, judgements, strict=True)]
    return told[0] if more_doubtful(told[-1][2], told[0][2]) else told[-1]


def more_doubtful(motion: Motion, than: Motion) -> bool:
    """Whether a limb is in doubt more than the most doubtful one of another motion, on average over the frames."""
    doubt = lambda one: 0.0 if one.limb_doubt is None else float(np.max(np.mean(one.limb_doubt, axis=0), initial=0.0))
    return doubt(motion) > doubt(than) + MORE_DOUBT


def _judgements(jobs: Sequence[Job], cells: Iterable[FrameInput], motion: Motion) -> list[list[LimbConfidence]]:
    """Of each job's body in every frame, frame by frame, so that cells need not be kept."""
    parts = zip(jobs, tee(cells, len(jobs)), strict=True)
    each = [confidence_of_poses(job.tracker, np.asarray(motion.pose), part) for job, part in parts]
    found: list[list[LimbConfidence]] = [[] for _ in jobs]
    for frame in zip(*each, strict=True):
        for judgements, judgement in zip(found, frame, strict=True):
            judgements.append(judgement)
    return found


def _told(job: Job, found: list[LimbConfidence], prefix: Prefix, motion: Motion) -> tuple[Prefix, Motion]:
    """The frames and the motion with what was said of them, if anything was."""
    if not found:
        return prefix, motion
    rows = {key: np.stack([np.asarray(getattr(each, name)) for each in found]) for key, name in JUDGEMENT.items()}
    said = Judged.of(found, job.recording.rig.names).of_actor(0, job.bodies[0], slice(None))
    return Prefix(prefix.rows | rows), replace(motion, **{key: np.asarray(value) for key, value in said.items()})
