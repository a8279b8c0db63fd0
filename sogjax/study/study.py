"""A study: some experiments over some recordings, every run of them done once."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from sogjax.errors import InputError
from sogjax.study.experiment import Experiment
from sogjax.study.record import RunFolder, RunRecord
from sogjax.study.runner import run_row
from sogjax.study.settings import USUAL_FRAMES, ReportConfig
from sogjax.study.source import Source, rendered_source, source_named
from sogjax.study.summary import RowSummary, summarized

_GROUPS = ("color", "images", "energy", "solver", "tracking")
"""Settings that are a run's; recordings, actors and outputs are the study's."""


@dataclass(eq=False)
class Study:
    """Where its runs are kept, and what they are made on."""

    folder: Path
    recordings: Sequence[str]
    """Folders with ground truth, or MOTION:SEED."""
    frames: int | None = None
    """Tracked of each recording, at most; None: as many as the experiment asks for, or the usual number."""
    overrides: Sequence[str] = ()
    """Overrides of the track config, for all runs."""
    do: bool = True
    """Whether runs that are missing are done; else they are left out."""
    body: str = "human"
    """The body that actors are made from."""
    compared: Sequence[str] | None = None
    """Recordings of slow experiments; None: one seed of each motion, and all folders."""

    @classmethod
    def from_config(cls, config: ReportConfig, folder: Path) -> "Study":
        """The study of a report."""
        return cls(folder, config.recordings, config.frames, config.overrides, config.do, config.body, config.compared)

    @cached_property
    def runs(self) -> RunFolder:
        """The records."""
        return RunFolder(self.folder)

    def __post_init__(self) -> None:
        self._sources: dict[tuple[str, int], Source] = {}
        if not self.recordings:
            raise InputError("recordings=[]: name at least one, a folder or MOTION:SEED such as walk:0")
        if self.frames is not None and self.frames < 2:
            raise InputError(f"frames={self.frames}: must be at least 2, since markers are attached in the first one")
        for word in self.overrides:
            if word.partition("=")[0].partition(".")[0] not in _GROUPS:
                raise InputError(f"overrides: {word}: is not a setting of a run; choose from {', '.join(_GROUPS)}")

    @property
    def is_committed(self) -> bool:
        """Whether it is what the project's own report was made of, of which the remarks speak."""
        usual = ReportConfig()
        return (
            {*self.recordings} >= {*usual.recordings}
            and self.frames in (None, USUAL_FRAMES)
            and not self.overrides
            and not self.compared
        )

    def source(self, recording: str | Mapping[str, Any], frames: int | None = None) -> Source:
        """A recording by its name, or by the settings of a rendered one, opened once.

        Args:
            recording: a name of the study's recordings, or settings of `sogjax synth`.
            frames: that are tracked where the study does not say; None: the usual number.

        Raises:
            InputError: there is none of that name, or it cannot be rendered so.
        """
        count = self.frames or frames or USUAL_FRAMES
        key = (str(recording), count)
        if key not in self._sources:
            if isinstance(recording, str):
                source = source_named(recording, count, self.folder, self.body)
            else:
                source = rendered_source(recording, count, self.folder, self.body)
            others = [other for other in self._sources.values() if other.identity != source.identity]
            alike = [other for other in others if other.name.partition(" ")[0] == source.name]
            name = f"{source.name} {len(alike) + 1}" if alike else source.name
            self._sources[key] = replace(source, name=name)
        return self._sources[key]

    def sources_of(self, experiment: Experiment, row: str) -> list[Source]:
        """The recordings that a row is tracked on."""
        own, frames = experiment.config.rows[row].synth, experiment.config.frames
        if own is not None:
            return [self.source(own, frames)]
        names = experiment.config.recordings if self.is_committed else None
        usual = self._compared if experiment.is_slow else self.recordings
        return [self.source(name, frames) for name in names or usual]

    @property
    def _compared(self) -> list[str]:
        """The recordings of slow experiments."""
        if self.compared is not None:
            return [*self.compared]
        seeds: dict[str, str] = {}
        for name in self.recordings:
            seeds.setdefault(name if Path(name).is_dir() else name.partition(":")[0], name)
        return [*seeds.values()]

    def records(self, experiment: Experiment, method: str = "") -> Iterator[tuple[str, Source, RunRecord]]:
        """Every run of an experiment with a method as (row, recording, record), as they are done or read."""
        for row in experiment.rows_of(method):
            for source in self.sources_of(experiment, row):
                record = run_row(experiment, row, source, self.runs, self.overrides, self.do, method)
                if record is not None:
                    yield row, source, record

    def summary(self, experiment: Experiment, method: str = "") -> list[RowSummary]:
        """The rows of an experiment with a method; those without any run are left out."""
        rows: dict[str, dict[str, RunRecord]] = {row: {} for row in experiment.rows_of(method)}
        for row, source, record in self.records(experiment, method):
            rows[row][source.name] = record
        papers = {name: (row.paper, row.paper_value) for name, row in experiment.config.rows.items()}
        found = summarized(rows, experiment.config.reference, papers)
        return [row for row in found if row.by_recording or row.failed]
