"""Hydra callback that gathers the members of a sweep and prints their table at the end."""

from typing import Any

from hydra.core.utils import JobReturn, JobStatus
from hydra.experimental.callback import Callback
from omegaconf import DictConfig

from sogjax.app.sweep import table


class SweepTable(Callback):
    """One row for each member: what was overridden, and the numbers that the task returned."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, dict[str, float] | str]] = []

    def on_job_end(self, config: DictConfig, job_return: JobReturn, **kwargs: Any) -> None:
        """Keep the row of a member that ended."""
        name = " ".join(_own_overrides(job_return)) or "as configured"
        if job_return.status == JobStatus.COMPLETED:
            self.rows.append((name, job_return.return_value))
        else:
            self.rows.append((name, str(job_return._return_value)))

    def on_multirun_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Print the table."""
        print(table(self.rows))


def _own_overrides(job_return: JobReturn) -> list[str]:
    """The overrides of a member, without those that only say where things are."""
    places = ("recording=", "out=", "actor=")
    return [text for text in job_return.overrides or [] if not text.startswith(places)]
