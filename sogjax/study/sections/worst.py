"""The section of the worst frames."""

from collections.abc import Sequence

import numpy as np

from sogjax.study.document import Picture, Section
from sogjax.study.done import Done
from sogjax.study.pictures import worst_frame


def worst_section(done: Sequence[Done], count: int) -> Section:
    """The frames with the largest errors, at most one per experiment and method."""
    usable = [one for one in done if one.experiment.config.measure == "accuracy" and np.isfinite(one.record.mean_mm)]
    pictures: list[Picture] = []
    seen: set[tuple[str, str]] = set()
    for one in sorted(usable, key=lambda one: -np.nanmax(one.record.errors)):
        if (one.experiment.name, one.method) not in seen and len(pictures) < count:
            seen.add((one.experiment.name, one.method))
            parts = (one.experiment.config.title, one.method, one.row)
            pictures.append(worst_frame(", ".join(filter(None, parts)), one.source, one.record))
    return Section("Worst frames", ["The frame with the largest mean error of an experiment's runs."], pictures)
