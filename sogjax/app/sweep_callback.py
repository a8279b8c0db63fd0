"""Hydra callback that gathers the members of a sweep and prints their table at the end."""

from collections.abc import Sequence
from typing import Any

from hydra.core.utils import JobReturn, JobStatus
from hydra.experimental.callback import Callback

from sogjax.app.sweep import table


class SweepTable(Callback):
    """One row for each member: what was overridden, and the numbers that the task returned."""

    def __init__(self) -> None:
        self.rows: list[tuple[list[str], dict[str, float] | str]] = []

    def on_job_end(self, config: Any, job_return: JobReturn, **kwargs: Any) -> None:
        """Keep the row of a member that ended."""
        overrides = list(job_return.overrides or [])
        if job_return.status == JobStatus.COMPLETED:
            self.rows.append((overrides, job_return.return_value))
        else:
            self.rows.append((overrides, str(job_return._return_value)))

    def on_multirun_end(self, config: Any, **kwargs: Any) -> None:
        """Print the table."""
        names = differing([overrides for overrides, _ in self.rows])
        print(table([(name, numbers) for name, (_, numbers) in zip(names, self.rows, strict=True)]))


def differing(members: Sequence[Sequence[str]]) -> list[str]:
    """What tells the members of a sweep apart: the overrides that not all of them have."""
    common = set.intersection(*(set(overrides) for overrides in members)) if members else set()
    return [" ".join(text for text in overrides if text not in common) or "as configured" for overrides in members]
