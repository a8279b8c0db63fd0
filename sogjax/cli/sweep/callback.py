"""Hydra callback that collects the results of a sweep and prints their table at the end."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hydra.core.utils import JobReturn, JobStatus
from hydra.experimental.callback import Callback
from hydra.types import RunMode

from sogjax.cli.sweep.results import Failure, Member, finish_sweep, forget_results, keep_result, kept_results
from sogjax.cli.sweep.take_table import keep_row
from sogjax.run.shared_start import forget_shared_openings

failures: list[str] = []
"""Why members of the last sweep of this process failed, whatever process they ran in."""


class SweepTable(Callback):
    """Each member leaves a file in its folder, whatever process it runs in; the table is made from these.

    `takes` are the folders and actors of several recordings by the numbers of the members: their table is made by the
    command itself, since it holds recordings that no member tracks, too.
    """

    def __init__(self, takes: Sequence[Any] | None = None):
        self._takes = takes

    def on_multirun_start(self, config: Any, **kwargs: Any) -> None:
        """Remove the results of an earlier sweep in the same folder."""
        failures.clear()
        forget_shared_openings()
        if not self._takes:
            forget_results(Path(config.hydra.sweep.dir))

    def on_job_end(self, config: Any, job_return: JobReturn, **kwargs: Any) -> None:
        """Keep the row of a member that ended."""
        if config.hydra.mode != RunMode.MULTIRUN:
            return
        completed = job_return.status == JobStatus.COMPLETED
        result = job_return.return_value if completed else Failure(job_return._return_value)
        member, folder = Member(list(job_return.overrides or []), result), Path(config.hydra.runtime.output_dir)
        if self._takes:
            keep_row(folder, member)
        else:
            keep_result(folder, member)

    def on_multirun_end(self, config: Any, **kwargs: Any) -> None:
        """Print the table; write the CSV and the plot."""
        if self._takes:
            return
        sweep = Path(config.hydra.sweep.dir)
        members = kept_results(sweep)
        failures.extend(member.result for member in members if isinstance(member.result, str))
        finish_sweep(sweep, members)
