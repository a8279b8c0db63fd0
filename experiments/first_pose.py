"""Is an initial pose that is called sure right?

    python experiments/first_pose.py [limit=200] [minutes=60] [out=outputs/first_pose] [sequences=[walk,hug]]

Frames of the yardstick sequences are drawn at random, with 3 to 12 cameras, with plates and without, and searched
without a hint. A pose is right if its joints are within 10 cm of the truth on average, left and right are not
exchanged, and it is not taken back to front. Searches that were made are kept, and not made again by the same program.
Writes `searches.csv` and `reliability.png`.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float
from scipy.stats import beta
from searches import RIGHT, Search, Searches, drawn_trials

from sogjax.errors import InputError
from sogjax.io.files import csv_text, write_file
from sogjax.run.terminal import say
from sogjax.study.experiment import yardsticks
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.study import Study
from sogjax.study.table import ruled_table
from sogjax.view.charts import INK, REFERENCE, WRONG, grid, new_figure, png

MM = 1000.0


@dataclass(frozen=True)
class Reliability:
    """Poses that searches found, in the order of their confidence."""

    confidence: Float[np.ndarray, "search"]
    error: Float[np.ndarray, "search"]
    """Metres, mean over the joints."""
    sure: Bool[np.ndarray, "search"]
    right: Bool[np.ndarray, "search"]
    bins: Sequence[tuple[int, int]]
    """The first search of each bin and the one after its last."""
    limit: float
    """Metres, above which a pose is wrong."""


def reliability_chart(found: Reliability) -> bytes:
    """Errors over confidence, and the share of right poses in bins of confidence."""
    figure = new_figure(8.4, 3.6)
    errors, shares = figure.subplots(1, 2)
    confidence = np.maximum(found.confidence, 1e-4)  # the axis is logarithmic
    for chosen, marker, label in ((found.sure, "o", "sure"), (~found.sure, "x", "not sure")):
        for right, color in ((True, INK), (False, WRONG)):
            those = chosen & (found.right == right)
            words = f"{label}, {'right' if right else 'wrong'}: {int(those.sum())}"
            errors.plot(confidence[those], MM * found.error[those], marker, color=color, markersize=4, label=words)
    errors.axhline(MM * found.limit, color=REFERENCE, linewidth=0.8, linestyle="--")
    errors.set(xscale="log", yscale="log", xlabel="confidence", ylabel="mean joint error, mm")
    middles = [float(np.median(confidence[first:stop])) for first, stop in found.bins]
    right = [float(found.right[first:stop].mean()) for first, stop in found.bins]
    shares.plot(middles, right, "o-", color=INK, markersize=4)
    for middle, share, (first, stop) in zip(middles, right, found.bins, strict=True):
        shares.annotate(f"{stop - first}", (middle, share), xytext=(0, 5), textcoords="offset points", fontsize=6)
    shares.set(xscale="log", ylim=(0.0, 1.08), xlabel="confidence (median of a bin)", ylabel="share of right poses")
    grid(errors, "both", legend=True)
    grid(shares, "both")
    return png(figure)


BINS = 8
GROUPS: dict[str, Callable[[Search], bool]] = {
    "all": lambda search: True,
    "plates": lambda search: search.trial.plates,
    "no plates": lambda search: not search.trial.plates,
    "3 and 4 cameras": lambda search: search.trial.cameras <= 4,
    "5 to 8 cameras": lambda search: 4 < search.trial.cameras <= 8,
    "9 to 12 cameras": lambda search: search.trial.cameras > 8,
}


def sure_table(searches: Sequence[Search]) -> str:
    """How many poses were called sure, how many of those are right, and the same of the others, by group."""
    titles = [
        "searches",
        "sure",
        "of these right",
        "at least (95 %)",
        "not sure",
        "of these right",
        "refused",
        "median s",
        "of the processor",
    ]
    lines = [["", *titles]]
    for name, belongs in GROUPS.items():
        group = [search for search in searches if belongs(search)]
        if group:
            sure = [search for search in group if search.sure]
            doubtful = [search for search in group if not search.sure and search.error is not None]
            lines.append(
                [
                    *(name, str(len(group)), str(len(sure)), _right(sure), f"{100.0 * least_share(sure):.0f} %"),
                    *(str(len(doubtful)), _right(doubtful), str(sum(search.error is None for search in group))),
                    f"{np.median([search.seconds for search in group]):.0f}",
                    f"{np.median([search.processor_seconds for search in group]):.0f}",
                ]
            )
    return ruled_table(lines)


def least_share(searches: Sequence[Search]) -> float:
    """The share that is right, at least so with a confidence of 95 % (Clopper and Pearson)."""
    right = sum(search.is_right for search in searches)
    return float(beta.ppf(0.05, right, len(searches) - right + 1)) if right else 0.0


def wrong_table(searches: Sequence[Search]) -> str:
    """Every pose that was called sure and is not right, for those who look at the failures."""
    lines = [
        ["search", "sequence", "actor", "cameras", "plates", "frame", "confidence", "joints, mm", "worst limb", "kind"]
    ]
    for search in searches:
        trial, error = search.trial, search.error
        if search.sure and error is not None and not error.is_right:
            where = [str(trial.number), trial.sequence, search.actor, str(trial.cameras), _yes(trial.plates)]
            worst = f"{error.worst_limb}, {MM * error.worst:.0f} mm"
            said = [str(trial.frame), f"{search.confidence:.4g}", f"{MM * error.joints:.0f}", worst, error.kind]
            lines.append([*where, *said])
    return ruled_table(lines) if len(lines) > 1 else "Of the poses that were called sure none is wrong."


def kinds_line(searches: Sequence[Search]) -> str:
    """How often which mistake was made."""
    kinds = [search.error.kind for search in searches if search.error is not None]
    counted = sorted({kind: kinds.count(kind) for kind in kinds}.items(), key=lambda pair: -pair[1])
    return ", ".join(f"{kind}: {count}" for kind, count in counted)


def reliability(searches: Sequence[Search]) -> Reliability:
    """Confidences of all searches that named a pose, their errors, and the share that is right in bins as large."""
    found = sorted((search for search in searches if search.error is not None), key=lambda search: search.confidence)
    parts = [part for part in np.array_split(np.arange(len(found)), min(BINS, max(len(found) // 4, 1))) if len(part)]
    return Reliability(
        confidence=np.array([search.confidence for search in found]),
        error=np.array([search.error.joints for search in found if search.error is not None]),
        sure=np.array([search.sure for search in found], bool),
        right=np.array([search.is_right for search in found], bool),
        bins=[(int(part[0]), int(part[-1]) + 1) for part in parts],
        limit=RIGHT,
    )


def write_searches(path: Path, searches: Sequence[Search]) -> None:
    """A row for each search and actor, as CSV."""
    lines: list[Sequence[object]] = [
        [
            *("number", "sequence", "actor", "cameras", "turn", "plates", "frame", "sure", "confidence", "joints mm"),
            *("worst limb", "worst mm", "kind", "seconds", "processor seconds", "refused"),
        ]
    ]
    for search in searches:
        trial, error = search.trial, search.error
        off = ["", "", "", ""]
        if error is not None:
            off = [f"{MM * error.joints:.1f}", error.worst_limb, f"{MM * error.worst:.1f}", error.kind]
        place = [trial.number, trial.sequence, search.actor, trial.cameras, trial.turn, trial.plates, trial.frame]
        said = [search.sure, f"{search.confidence:.6g}"]
        times = [f"{search.seconds:.1f}", f"{search.processor_seconds:.1f}"]
        lines.append([*place, *said, *off, *times, search.refused])
    write_file(path, csv_text(lines))


def _right(searches: Sequence[Search]) -> str:
    right = sum(search.is_right for search in searches)
    return f"{right} ({100.0 * right / len(searches):.1f} %)" if searches else ""


def _yes(value: bool) -> str:
    return "yes" if value else "no"


@dataclass
class Settings:
    """What is searched, as `key=value` on the command line."""

    limit: int = 200
    """Searches, of all that are drawn."""
    minutes: float = 0.0
    """After which no further search is begun; 0: no bound."""
    sequences: list[str] = field(default_factory=list)
    """Rows of the experiment; none: all."""
    cameras: list[int] = field(default_factory=lambda: list(range(3, 13)))
    frames: int = 60
    """Of each recording, of which one is drawn."""
    seed: int = 0
    """From which searches are drawn."""
    body: str = "human"
    overrides: list[str] = field(default_factory=list)
    """Of track."""
    out: str = "outputs/first_pose"
    """Where searches, actors and results are kept."""


def main() -> None:
    """Search, print the tables, and write the files."""
    settings = settings_from(Settings)
    out = Path(settings.out)
    searches = [*_searched(settings, out)]
    if not searches:
        raise InputError(f"minutes={settings.minutes:g}: no search was made; give more time")
    print(machine_line(), sure_table(searches), kinds_line(searches), wrong_table(searches), sep="\n\n")
    write_searches(out / "searches.csv", searches)
    write_file(out / "reliability.png", reliability_chart(reliability(searches)))
    print(f"\n{out / 'searches.csv'}\n{out / 'reliability.png'}")


def _searched(settings: Settings, out: Path) -> list[Search]:
    """The searches that were made before or can be made in the time."""
    study = Study(out, ["walk:0"], settings.frames, body=settings.body)
    folder = Searches(study, settings.overrides)
    begin, found = time.perf_counter(), []
    trials = drawn_trials(
        yardsticks(settings.sequences), settings.cameras, settings.frames, settings.limit, settings.seed
    )
    for trial in trials:
        late = settings.minutes > 0.0 and time.perf_counter() - begin > 60.0 * settings.minutes
        found += folder.of(trial, do=not late)
    if len({search.trial.number for search in found}) < settings.limit:
        say(f"{len({search.trial.number for search in found})} of {settings.limit} searches are done")
    return found


if __name__ == "__main__":
    run_script(main)
