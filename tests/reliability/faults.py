"""Runs whose surroundings fail: what was said, what is left, and the end after going on.

python tests/reliability/faults.py [only=disk]

Each run is a process of its own, and each fault of `fault_cases.py` is made for real. Afterwards it is looked how many
frames can be read; then the same command with resume=true goes on, and every array of its end is compared with that of
a run that was left alone.
"""

import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from kill_and_resume import Settings, Undisturbed, check_same, frames_left, started
from kill_and_resume import undisturbed as left_alone

from sogjax.errors import InputError
from sogjax.run.compilation_cache import VARIABLE
from sogjax.study.script import machine_line, run_script, settings_from

SAME = "bit for bit that of the undisturbed run"


@dataclass
class FaultSettings:
    """Of the script."""

    only: str | None = None
    """A word of the faults' names."""
    kills: int = 20


@dataclass(frozen=True)
class Said:
    """How a process ended."""

    status: int
    last: str
    """Line on standard error."""
    traceback: bool = False

    def __str__(self) -> str:
        return f"{'a TRACEBACK' if self.traceback else self.last or 'nothing'} ({self.status})"


@dataclass(frozen=True)
class Survived:
    """A fault, and what became of the run."""

    fault: str
    done: str
    """How it was made."""
    said: str
    frames: str
    """That could be read afterwards."""
    end: str
    """After it was gone on with."""
    good: bool = True


@dataclass(frozen=True)
class Ward:
    """Where faults are made, and the run to compare with."""

    place: Path
    settings: Settings
    alone: Undisturbed

    def resumed(
        self, fault: str, done: str, folder: Path, said: Said, command: Sequence[str] | None = None, status: int = 2
    ) -> Survived:
        """Go on in a folder after a fault, and compare the end.

        Args:
            fault: that was made.
            done: how.
            folder: of the run.
            said: by the run that met the fault.
            command: if not the one of the undisturbed run.
            status: with which the run should have ended.
        """
        frames = frames_left(folder)
        later = said_by(started([*(command or self.alone.command), "resume=true"], folder))
        end, same = self.compared(folder, later)
        good = same and said.status == status and not said.traceback
        return Survived(fault, done, str(said), str(frames), end, good)

    def compared(self, folder: Path, said: Said) -> tuple[str, bool]:
        """What a run's end is, and whether it is that of the undisturbed one."""
        if said.status != 0:
            return f"NONE: {said}", False
        try:
            check_same(folder, self.alone.motion, self.settings)
        except InputError as error:
            return f"NOT THE SAME: {str(error).removeprefix(f'{folder}: ')}", False
        return SAME, True


def said_by(process: subprocess.Popen, about: str = "") -> Said:
    """Wait for the end of a process, and take its last line, or the last that holds some words."""
    _, said = process.communicate()
    lines = ["", *(line.strip() for line in said.splitlines() if line.strip())]
    wanted = [line for line in lines if about in line and process.returncode == 0]
    return Said(process.returncode, [*lines, *wanted][-1], "Traceback" in said)


def survived(kills: int, only: str | None = None) -> list[Survived]:
    """Make all faults, or those with a word in their names."""
    from fault_cases import FAULTS

    with TemporaryDirectory() as folder:
        place = Path(folder)
        os.environ.setdefault(VARIABLE, str(place / "programs"))
        settings = Settings(kills=kills)
        ward, rows = Ward(place, settings, left_alone(settings, place)), []
        for name, make in FAULTS.items():
            if only is None or only in name:
                try:
                    found = make(ward)
                except (OSError, ValueError, subprocess.SubprocessError) as error:
                    found = Survived(name, "the fault could not be made", repr(error), "", "", good=False)
                for row in found if isinstance(found, list) else [found]:
                    rows.append(row)
                    print(f"{row.fault}: {row.said}; {row.frames} frames; {row.end}", flush=True)
        return [shortened(row, place) for row in rows]


def shortened(row: Survived, place: Path) -> Survived:
    """Without the temporary folder's name."""
    said, end = (text.replace(f"{place}/", "").replace(str(place), ".") for text in (row.said, row.end))
    return Survived(row.fault, row.done, said, row.frames, end, row.good)


def main() -> None:
    """Print what became of every run."""
    settings = settings_from(FaultSettings)
    print(machine_line())
    rows = survived(settings.kills, settings.only)
    for row in rows:
        print(f"{row.fault} | {row.done} | {row.said} | {row.frames} | {row.end} | {'good' if row.good else 'BAD'}")
    sys.exit(0 if all(row.good for row in rows) else 1)


if __name__ == "__main__":
    run_script(main)
