"""What commands do about wrong input: their exit status, what they say, and whether every file is as it was."""

import contextlib
import hashlib
import io
import os
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path

from bad_inputs import BadInput, make_workplace

from sogjax.cli.main import main as sogjax


@dataclass(frozen=True)
class Outcome:
    """How a command answered an input."""

    case: BadInput
    status: int | str
    said: str
    nothing_left: bool

    @property
    def good(self) -> bool:
        """Whether it was refused with one sentence and nothing changed."""
        return self.status == 2 and self.nothing_left and len(self.said.splitlines()) == 1


def outcomes_of(inputs: list[BadInput]) -> list[Outcome]:
    """Try each case in a fresh copy of the workplace."""
    with tempfile.TemporaryDirectory() as place:
        good = Path(place) / "good"
        good.mkdir()
        make_workplace(good)
        return [outcome_of(case, good, Path(place) / "work") for case in inputs]


def outcome_of(case: BadInput, good: Path, work: Path) -> Outcome:
    """Damage a copy, run the command in it, and compare the files before and after."""
    shutil.copytree(good, work)
    case.damage(work)
    before = contents(work)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.chdir(work), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status: int | str = sogjax(case.command)
        except BaseException as error:
            status = f"{type(error).__name__}: {error}"
    nothing_left = contents(work) == before
    shutil.rmtree(work)
    said = err.getvalue().strip().replace(f"{os.path.realpath(work)}/", "").replace(f"{work}/", "")
    return Outcome(case, status, said, nothing_left)


def contents(folder: Path) -> dict[str, str]:
    """Every file and folder with a digest of its content."""
    digest = lambda path: hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else "folder"
    return {str(path.relative_to(folder)): digest(path) for path in sorted(folder.rglob("*"))}
