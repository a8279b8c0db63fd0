"""The results of a sweep: a file per member, then one table, one CSV and one plot of all of them.

Launchers may run members in other processes or on other machines, so their results go through files.
"""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import UInt8

from sogjax.data.atomic import atomic_path
from sogjax.engine.run_numbers import COLUMNS, OBJECTIVE
from sogjax.view.plots import plot_per_point, write_png

RESULT = "result.json"


class Failure(str):
    """Why a member failed; as one number, worse than any other, so that a search continues elsewhere."""

    def __float__(self) -> float:
        return float("inf")


class Member(NamedTuple):
    """A member that has ended."""

    overrides: list[str]
    result: Mapping[str, float] | str
    """Its numbers, or why it failed."""


def keep_result(folder: Path, member: Member) -> None:
    """Write a member's result into its own folder.

    Raises:
        InputError: the folder cannot be written.
    """
    with atomic_path(folder / RESULT) as temporary:
        temporary.write_text(json.dumps({"overrides": member.overrides, "result": member.result}), encoding="utf-8")


def forget_results(sweep: Path) -> None:
    """Remove the results of an earlier sweep from a folder."""
    for path in sweep.glob(f"*/{RESULT}"):
        path.unlink()


def kept_results(sweep: Path) -> list[Member]:
    """The results of a sweep's members, in the order of their numbers."""
    paths = sorted(sweep.glob(f"*/{RESULT}"), key=lambda path: (len(path.parent.name), path.parent.name))
    return [Member(**json.loads(path.read_text(encoding="utf-8"))) for path in paths]


def finish_sweep(sweep: Path, members: Sequence[Member]) -> None:
    """Print the table, and write `sweep.csv` and `sweep.png` into the sweep's folder.

    Raises:
        InputError: the folder cannot be written.
    """
    if not members:
        return
    names = differing([member.overrides for member in members])
    print(table([(name, member.result) for name, member in zip(names, members, strict=True)]))
    with atomic_path(sweep / "sweep.csv") as temporary:
        temporary.write_text(_csv(members), encoding="utf-8")
    print(f"\n{sweep / 'sweep.csv'}")
    if any(not isinstance(member.result, str) and np.isfinite(member.result[OBJECTIVE]) for member in members):
        write_png(sweep / "sweep.png", _chart(members))
        print(sweep / "sweep.png")


def _chart(members: Sequence[Member]) -> UInt8[np.ndarray, "h w 3"]:
    """The mean marker errors of the members, and which failed."""
    own = _own_words([member.overrides for member in members])
    keys = dict.fromkeys(_setting(word)[0] for words in own for word in words)
    labels = [" ".join(_setting(word)[1] for word in words) or "as configured" for words in own]
    failed = [number for number, member in enumerate(members) if isinstance(member.result, str)]
    errors = [np.nan if isinstance(m.result, str) else 1e-3 * m.result[OBJECTIVE] for m in members]
    title = f"mean marker error over {', '.join(keys) or 'one run'}"
    return plot_per_point(np.asarray(errors, float), labels, title, failed=failed)


def differing(members: Sequence[Sequence[str]]) -> list[str]:
    """The overrides that differ between the members of a sweep."""
    return [" ".join(words) or "as configured" for words in _own_words(members)]


def _own_words(members: Sequence[Sequence[str]]) -> list[list[str]]:
    """For each member, its overrides that differ between members."""
    common = set.intersection(*(set(overrides) for overrides in members)) if members else set()
    return [[word for word in overrides if word not in common] for overrides in members]


def _setting(override: str) -> tuple[str, str]:
    """Key and value of an override; `~key` removes the key."""
    key, _, value = override.partition("=")
    return key.lstrip("+~"), "taken away" if key.startswith("~") else value


def table(rows: Sequence[tuple[str, Mapping[str, float] | str]]) -> str:
    """A plain-text table of settings and results."""
    width = max(len("settings"), *(len(name) for name, _ in rows)) if rows else 8
    lines = [f"{'settings':<{width}}" + "".join(f"{column:>14}" for column in COLUMNS)]
    for name, numbers in rows:
        if isinstance(numbers, str):
            lines.append(f"{name:<{width}}   failed: {numbers}")
        else:
            lines.append(f"{name:<{width}}" + "".join(f"{numbers[column]:>14.2f}" for column in COLUMNS))
    return "\n".join(lines)


def _csv(members: Sequence[Member]) -> str:
    """One line per member: a column per key that differs, then the numbers, then why it failed."""
    settings = [dict(_setting(word) for word in member.overrides) for member in members]
    keys = list(dict.fromkeys(key for setting in settings for key in setting))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*keys, *COLUMNS, "failed"])
    for setting, member in zip(settings, members, strict=True):
        failed = isinstance(member.result, str)
        numbers = [""] * len(COLUMNS) if isinstance(member.result, str) else [member.result[c] for c in COLUMNS]
        writer.writerow([*(setting.get(key, "") for key in keys), *numbers, member.result if failed else ""])
    return text.getvalue()
