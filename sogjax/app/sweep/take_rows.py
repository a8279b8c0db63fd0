"""What became of each recording among several: kept in its folder, and read for the table of all."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from sogjax.app.sweep.results import RESULT, Member, keep_result, kept_member
from sogjax.app.sweep.take_table import NO_RESULT, Row
from sogjax.engine.clock import TOTAL
from sogjax.engine.kept_run import FOLDER, NOTE, read_note
from sogjax.engine.run import Run
from sogjax.engine.run_numbers import row_numbers
from sogjax.engine.terminal import say
from sogjax.settings import TrackConfig

FAILED = "failed.json"
"""Why the last command failed here; beside `result.json`, the row of the run that ended here before, if one did."""


def track_take(config: TrackConfig, actor: Any, out: Path, track: Callable[[TrackConfig], Run]) -> dict[str, Any]:
    """Track a recording among several into its folder, going on where an earlier command stopped; its numbers."""
    config.out, config.actor = str(out), config.actor if actor is None else list(actor)
    config.resume = not config.overwrite and ((out / NOTE).is_file() or (out / FOLDER).is_dir())
    before = _kept_row(out) if config.resume else None
    say(f"\n== {config.recording}")
    result = track(config)
    if before is not None:
        return before
    verdict = "; ".join(verdict.sentence for verdict in result.verdicts.values())
    seconds = read_note(out / NOTE).get("seconds") or {}
    return row_numbers(result) | {
        "frames": len(result.converged),
        "seconds": seconds.get(TOTAL, float("nan")),
        "verdict": verdict,
    }


def keep_row(folder: Path, member: Member) -> None:
    """Keep the numbers of a recording's run, or why it failed; a failure leaves the numbers of an earlier run.

    Raises:
        InputError: the folder cannot be written.
    """
    keep_result(folder, member, FAILED if isinstance(member.result, str) else RESULT)


def forget_failure(folder: Path) -> None:
    """Forget why an earlier command failed here."""
    with suppress(OSError):
        (folder / FAILED).unlink()


def row_of(place: str, folder: Path) -> Row:
    """What became of a recording, whose results lie in a folder."""
    failed = kept_member(folder, FAILED)
    result = _kept_row(folder) if failed is None else failed.result
    return Row(place, folder, NO_RESULT if result is None else result)


def _kept_row(folder: Path) -> dict[str, Any] | None:
    """The numbers of the run that ended in a folder; None where none did, or only those of one before were kept."""
    kept = kept_member(folder)
    if kept is None or isinstance(kept.result, str) or not (folder / NOTE).is_file():
        return None
    is_of_it = (folder / RESULT).stat().st_mtime_ns >= (folder / NOTE).stat().st_mtime_ns
    return dict(kept.result) if is_of_it else None
