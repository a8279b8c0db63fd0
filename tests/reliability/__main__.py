"""How are wrong inputs answered, and is anything left half-written?

    python tests/reliability [page=docs/reliability.md] [only=calibration] [faults=false]

Every case of `bad_input_cases.py` damages a valid workplace in one place and runs a command there. It passes if the
exit status is 2, the message is one sentence, and all files are unchanged. Then the readers get thousands of damaged
files: each must be read or refused with one sentence. Last, the surroundings of runs fail (`faults.py`): a run must
report it, lose nothing that was written, and give the same result when it is resumed.
"""

import sys
from dataclasses import dataclass
from pathlib import Path

from bad_input_cases import cases
from faults import survived
from fuzzing import fuzz_readers
from outcomes import outcomes_of
from page import page

from sogjax.io.files import atomic_path
from sogjax.study.script import run_script, settings_from


@dataclass
class Settings:
    """What is tried, and where the page is written."""

    page: str | None = None
    only: str | None = None
    """One family of wrong inputs."""
    mutations: int = 2000
    """Damaged files per reader."""
    faults: bool = True
    """Whether to inject faults into runs."""
    kills: int = 20
    """How many runs are killed."""


def main() -> None:
    """Print what failed, and write the page."""
    settings = settings_from(Settings)
    outcomes = outcomes_of([case for case in cases() if settings.only in (None, case.family)])
    fuzzed = fuzz_readers(settings.mutations) if settings.only is None else []
    failed = survived(settings.kills) if settings.faults and settings.only is None else []
    bad = [outcome for outcome in outcomes if not outcome.good]
    for outcome in bad:
        print(f"{outcome.case.family}: {outcome.case.what}: status {outcome.status}, {outcome.said!r}")
        print(f"    nothing left: {outcome.nothing_left}")
    crashes = [reader for reader in fuzzed if reader.crashes]
    for reader in crashes:
        print(f"{reader.name}: {reader.crashes[0]}")
    lost = [row for row in failed if not row.good]
    for row in lost:
        print(f"{row.fault}: {row.done}: {row.said}, {row.frames} frames; {row.end}")
    print(f"{len(outcomes) - len(bad)} of {len(outcomes)} wrong inputs refused as expected")
    if settings.page is not None:
        with atomic_path(Path(settings.page)) as temporary:
            temporary.write_text(page(outcomes, fuzzed, failed), encoding="utf-8")
    sys.exit(1 if bad or crashes or lost else 0)


if __name__ == "__main__":
    run_script(main)
