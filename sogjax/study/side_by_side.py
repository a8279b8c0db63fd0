"""The runs of an experiment on one recording, to be shown beside each other."""

import numpy as np

from sogjax.errors import InputError
from sogjax.io.motion import Motion
from sogjax.study.experiment import Experiment
from sogjax.study.runner import motions_of, run_row
from sogjax.study.source import Source
from sogjax.study.study import Study


def of_experiment(
    study: Study, experiment: Experiment, source: Source
) -> tuple[dict[str, list[Motion]], dict[str, np.ndarray]]:
    """The motions on one recording of every row that tracks it and did not fail, and their errors in metres.

    Raises:
        InputError: there is none.
    """
    motions, errors, failed = {}, {}, "all its rows have recordings of their own"
    for row, entry in experiment.config.rows.items():
        if entry.synth is not None:  # tracked on a recording of its own
            continue
        record = run_row(experiment, row, source, study.runs, study.overrides)
        if record is None or record.failed:
            failed = record.failed if record else failed
            continue
        motions[row] = list(motions_of(record, source.bodies, source.recording.fps).values())
        errors[row] = 1e-3 * record.errors
    if not motions:
        raise InputError(
            f"experiment={experiment.name}: no row worked on {source.name} ({failed}); choose another recording or "
            "experiment"
        )
    return motions, errors
