"""How far the motions of a sweep's members are from those of the first: what a setting changes, without any truth.

The results of a sweep: a file per member, then one table, one CSV and one plot of all of them.

Launchers may run members in other processes or on other machines, so their results go through files.
"""

import csv
import io
import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.io.motion import Motion, load_motion
from sogjax.run.run_numbers import COLUMNS, OBJECTIVE
from sogjax.run.terminal import say
from sogjax.view.charts import Bars, bar_chart

MM = 1000.0


def distances_to_first(folders: Sequence[Path | None]) -> list[float]:
    """For each folder of results the distance of its motions to those of the first one, in millimetres.

    NaN for members without a folder and where nothing can be compared.
    """
    first: Mapping[str, Motion] | None = None
    distances = []
    for folder in folders:
        motions = {} if folder is None else _motions(folder)
        if first is None and motions:
            first = motions
        distances.append(float("nan") if first is None else MM * mean_distance(motions, first))
    return distances


def mean_distance(motions: Mapping[str, Motion], others: Mapping[str, Motion]) -> float:
    """Metres, the mean over actors, frames and joints that both have; NaN where there are none."""
    parts = [_apart(motions[name], others[name]).ravel() for name in motions if name in others]
    apart = np.concatenate(parts) if parts else np.zeros(0)
    return float(apart.mean()) if apart.size else float("nan")


def _apart(motion: Motion, other: Motion) -> np.ndarray:
    _, rows, other_rows = np.intersect1d(motion.frame, other.frame, return_indices=True)
    _, joints, other_joints = np.intersect1d(motion.joint_names, other.joint_names, return_indices=True)
    places = motion.world_from_joint[np.ix_(rows, joints)][..., :3, 3]
    return np.linalg.norm(places - other.world_from_joint[np.ix_(other_rows, other_joints)][..., :3, 3], axis=-1)


def _motions(folder: Path) -> dict[str, Motion]:
    """The motions of a member by the names of their files; none where one cannot be read."""
    try:
        return {path.stem: load_motion(path) for path in sorted(folder.glob("motion*.npz"))}
    except InputError:
        return {}


RESULT = "result.json"
APART = "to first mm"
"""The column of `Member.apart`."""
ALL = (*COLUMNS[:6], APART, *COLUMNS[6:])
_COUNTS = ("lost", "swaps", "findings", "doubtful", "not converged")
_MEANINGS = {
    APART: "mean distance of the joints to those of the first member",
    "explained %": "of the visible area, how much shows the actor's own colours",
    "findings": "of the verdict; 0: it looks right",
    "doubtful": "stretches in which a limb is in doubt",
}
_TITLES = {OBJECTIVE: "mean marker error", APART: "mean distance of the joints to the first member's"}


class Failure(str):
    """Why a member failed; as one number, worse than any other, so that a search continues elsewhere."""

    def __float__(self) -> float:
        return float("inf")


class Member(NamedTuple):
    """A member that has ended."""

    overrides: list[str]
    result: Mapping[str, float] | str
    """Its numbers, or why it failed."""
    apart: float = float("nan")
    """Millimetres, the mean distance of its joints to those of the first member that worked; NaN where they cannot be
    compared."""


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


def finish_sweep(sweep: Path, members: Sequence[Member]) -> None:
    """Print the table, and write `sweep.csv` and `sweep.png` into the sweep's folder.

    Raises:
        InputError: the folder cannot be written.
    """
    if not members:
        return
    names = differing([member.overrides for member in members])
    rows = [with_distance(member) for member in members]
    print(table(list(zip(names, rows, strict=True))))
    if done := [row for row in rows if not isinstance(row, str)]:
        print(f"\n{legend(_known(done))}")
    with atomic_path(sweep / "sweep.csv") as temporary:
        temporary.write_text(_csv(members), encoding="utf-8")
    print(f"\n{sweep / 'sweep.csv'}")
    if all(isinstance(member.result, str) for member in members):
        say("no sweep.png: no member worked")
    elif (column := _drawn(members)) is None:
        say("no sweep.png: there is no truth, and the motions have no joints or frames in common")
    else:
        with atomic_path(sweep / "sweep.png") as temporary:
            temporary.write_bytes(_chart(members, column))
        print(sweep / "sweep.png")


def with_distance(member: Member) -> Mapping[str, float] | str:
    """A member's numbers and its distance to the first, or why it failed."""
    return member.result if isinstance(member.result, str) else {**member.result, APART: member.apart}


def _drawn(members: Sequence[Member]) -> str | None:
    """What the chart shows: the error where there is truth, else the distance to the first member."""
    rows = [row for member in members if not isinstance(row := with_distance(member), str)]
    return next((column for column in (OBJECTIVE, APART) if any(np.isfinite(row[column]) for row in rows)), None)


def _chart(members: Sequence[Member], column: str) -> bytes:
    """The chart (PNG) of a number of the members in millimetres, which also tells which failed."""
    own = _own_words([member.overrides for member in members])
    keys = dict.fromkeys(_setting(word)[0] for words in own for word in words)
    labels = [" ".join(_setting(word)[1] for word in words) or "as configured" for words in own]
    failed = [number for number, member in enumerate(members) if isinstance(member.result, str)]
    rows = [with_distance(member) for member in members]
    errors = [np.nan if isinstance(row, str) else row[column] for row in rows]
    title = f"{_TITLES[column]} over {', '.join(keys) or 'one run'}"
    return bar_chart([Bars(title, labels, {"": errors}, failed)], value="mm")


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
    """A plain-text table of settings and results; what no member knows, such as errors without a truth, is left out."""
    width = max(len("settings"), *(len(name) for name, _ in rows)) if rows else 8
    done = [numbers for _, numbers in rows if not isinstance(numbers, str)]
    columns = _known(done)
    lines = [f"{'settings':<{width}}" + "".join(f"{column:>14}" for column in columns)]
    for name, numbers in rows:
        if isinstance(numbers, str):
            lines.append(f"{name:<{width}}   failed: {numbers}")
        else:
            lines.append(f"{name:<{width}}" + "".join(_cell(column, float(numbers[column])) for column in columns))
    return "\n".join(lines)


def _known(done: Sequence[Mapping[str, float]]) -> list[str]:
    return [column for column in ALL if any(np.isfinite(numbers.get(column, np.nan)) for numbers in done)]


def _cell(column: str, value: float) -> str:
    if not np.isfinite(value):
        return f"{'-':>14}"
    digits = 4 if column == "similarity" else 0 if column in _COUNTS else 2
    return f"{value:>14.{digits}f}"


def legend(columns: Collection[str]) -> str:
    """What columns of the table are that nobody can guess."""
    lines = [f"{column}: {meaning}" for column, meaning in _MEANINGS.items() if column in columns]
    if OBJECTIVE not in columns:
        lines.append("there is no truth: these numbers compare the members, and do not rank them")
    return "\n".join(lines)


def _csv(members: Sequence[Member]) -> str:
    """One line per member: a column per key that differs, then the numbers, then why it failed."""
    settings = [dict(_setting(word) for word in member.overrides) for member in members]
    keys = list(dict.fromkeys(key for setting in settings for key in setting))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*keys, *ALL, "failed"])
    for setting, member in zip(settings, members, strict=True):
        row = with_distance(member)
        numbers = [""] * len(ALL) if isinstance(row, str) else [row[column] for column in ALL]
        writer.writerow([*(setting.get(key, "") for key in keys), *numbers, row if isinstance(row, str) else ""])
    return text.getvalue()
