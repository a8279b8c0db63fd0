"""What the members of a sweep, or the recordings of a command, leave in their folders, and what is read of it.

Launchers may run members in other processes or on other machines, so their results go through files: `result.json` with
the words and numbers of a member, `failed.json` beside it where a recording failed after an earlier run.
"""

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.io.motion import Motion, load_motion
from sogjax.run.clock import TOTAL
from sogjax.run.result import RunResult, row_numbers
from sogjax.run.run_files import KEPT, NOTE
from sogjax.run.run_folder import read_note
from sogjax.run.terminal import say
from sogjax.settings.run import TrackConfig

LOG = logging.getLogger(__name__)

RESULT, FAILED_FILE = "result.json", "failed.json"
NO_RESULT = "did not end; the same command again goes on with it"
FAILED = "FAILED: "
APART = "to first mm"
"""The column of a member's distance to the first."""


def reason(error: Exception, what: str) -> str:
    """Why something failed; what is not the input's fault is logged with its place, too, and others go on."""
    if isinstance(error, InputError):
        return str(error)
    LOG.exception(what)
    return f"{type(error).__name__}: {error}"


class Failure(str):
    """Why a member failed; as one number, worse than any other, so that a search continues elsewhere."""

    def __float__(self) -> float:
        return float("inf")


class Member(NamedTuple):
    """A member that has ended."""

    overrides: list[str]
    result: Mapping[str, Any] | str
    """Its numbers, or why it failed."""
    apart: float = float("nan")
    """Millimetres, the mean distance of its joints to those of the first member that worked; NaN where they cannot be
    compared."""

    @property
    def row(self) -> Mapping[str, Any] | str:
        """Its numbers and its distance to the first, or why it failed."""
        return self.result if isinstance(self.result, str) else {**self.result, APART: self.apart}


def keep_result(folder: Path, member: Member, name: str = RESULT) -> None:
    """Write a member's result into its own folder, as a file of that name.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(folder / name) as temporary:
        content = {"overrides": member.overrides, "result": member.result}
        temporary.write_text(json.dumps(content), encoding="utf-8")


def kept_member(folder: Path, name: str = RESULT) -> Member | None:
    """A member's result in its folder; None where there is none, or none that can be read."""
    try:
        return Member(**json.loads((folder / name).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return None


def forget_results(sweep: Path) -> None:
    """Remove the results of an earlier sweep from a folder."""
    for path in sweep.glob(f"*/{RESULT}"):
        path.unlink()


def kept_results(sweep: Path) -> list[Member]:
    """The results of a sweep's members, in the order of their numbers."""
    paths = sorted(sweep.glob(f"*/{RESULT}"), key=lambda path: (len(path.parent.name), path.parent.name))
    members = [Member(**json.loads(path.read_text(encoding="utf-8"))) for path in paths]
    apart = distances_to_first(
        [None if isinstance(member.result, str) else path.parent for member, path in zip(members, paths, strict=True)]
    )
    return [member._replace(apart=distance) for member, distance in zip(members, apart, strict=True)]


def distances_to_first(folders: Sequence[Path | None]) -> list[float]:
    """The distances of the motions in each folder of results to those in the first one, in millimetres.

    They are NaN for members without a folder and where nothing can be compared.
    """
    motions = [{} if folder is None else _motions(folder) for folder in folders]
    first = next(filter(None, motions), {})
    return [1000.0 * _mean_distance(each, first) for each in motions]


def _motions(folder: Path) -> dict[str, Motion]:
    """The motions of a member by the names of their files; none where one cannot be read."""
    try:
        return {path.stem: load_motion(path) for path in sorted(folder.glob("motion*.npz"))}
    except InputError:
        return {}


def _mean_distance(motions: Mapping[str, Motion], others: Mapping[str, Motion]) -> float:
    """The mean over actors, frames and joints that both have, in metres; NaN where there are none."""
    apart = [_apart(motions[name], others[name]).ravel() for name in motions if name in others]
    whole = np.concatenate([*apart, np.zeros(0)])
    return float(whole.mean()) if whole.size else float("nan")


def _apart(motion: Motion, other: Motion) -> np.ndarray:
    _, rows, other_rows = np.intersect1d(motion.frame, other.frame, return_indices=True)
    _, joints, other_joints = np.intersect1d(motion.joint_names, other.joint_names, return_indices=True)
    places = motion.world_from_joint[np.ix_(rows, joints)][..., :3, 3]
    return np.linalg.norm(places - other.world_from_joint[np.ix_(other_rows, other_joints)][..., :3, 3], axis=-1)


class Row(NamedTuple):
    """A recording and what became of it."""

    place: str
    folder: Path
    result: Mapping[str, Any] | str
    """Its numbers and its verdict, or why it failed."""

    @property
    def failed(self) -> str:
        """Why it failed, or an empty text."""
        return self.result if isinstance(self.result, str) else ""

    @property
    def sentence(self) -> str:
        """The verdict, or why there is none."""
        return f"{FAILED}{self.result}" if isinstance(self.result, str) else str(self.result.get("verdict") or "-")

    def number(self, column: str) -> float:
        """The value of a column; NaN where it is not known."""
        return float("nan") if isinstance(self.result, str) else float(self.result.get(column, np.nan))


def track_take(config: TrackConfig, actor: Any, out: Path, track: Callable[[TrackConfig], RunResult]) -> dict[str, Any]:
    """Track a recording among several into its folder, going on where an earlier command stopped; its numbers."""
    config.out, config.actor = str(out), config.actor if actor is None else list(actor)
    config.resume = not config.overwrite and (NOTE.of(out).is_file() or KEPT.of(out).is_dir())
    before = _kept_row(out) if config.resume else None
    say(f"\n== {config.recording}")
    result = track(config)
    if before is not None:
        return before
    verdict = "; ".join(verdict.sentence for verdict in result.verdicts.values())
    seconds = (read_note(NOTE.of(out)).get("seconds") or {}).get(TOTAL, float("nan"))
    return row_numbers(result) | {"frames": len(result.converged), "seconds": seconds, "verdict": verdict}


def keep_row(folder: Path, member: Member) -> None:
    """Keep the numbers of a recording's run, or why it failed; a failure leaves the numbers of an earlier run.

    Raises:
        InputError: the folder cannot be written.
    """
    keep_result(folder, member, FAILED_FILE if isinstance(member.result, str) else RESULT)


def forget_failure(folder: Path) -> None:
    """Forget why an earlier command failed here."""
    with suppress(OSError):
        (folder / FAILED_FILE).unlink()


def row_of(place: str, folder: Path) -> Row:
    """What became of a recording, whose results lie in a folder."""
    failed = kept_member(folder, FAILED_FILE)
    result = _kept_row(folder) if failed is None else failed.result
    return Row(place, folder, NO_RESULT if result is None else result)


def _kept_row(folder: Path) -> dict[str, Any] | None:
    """The numbers of the run that ended in a folder; None where none did, or only those of one before were kept."""
    kept = kept_member(folder)
    if kept is None or isinstance(kept.result, str) or not NOTE.of(folder).is_file():
        return None
    is_of_it = (folder / RESULT).stat().st_mtime_ns >= NOTE.of(folder).stat().st_mtime_ns
    return dict(kept.result) if is_of_it else None
