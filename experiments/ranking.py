"""Is what was lost the objective's fault, or the search's?

    python experiments/ranking.py recording=FOLDER motion=motion.npz [actor=actor.yaml] [every=5] [SET ...]

From the tracked pose of every frame and from the true one (the actor's own skeleton, fitted to the truth) the tracker's
solver climbs to an optimum, and the two are compared. Where a limb was lost, either the wrong pose is worth more, so
no search can help, or the true one is, and was not reached. So the truth is an oracle: one more hypothesis beside the
tracked pose, and a table tells in what share of the frames the tracker's energy chooses it, and by how much. `every=5`
looks at every fifth frame. A SET is what `sogjax track` takes, in one word:

    python experiments/ranking.py recording=R motion=M default "preset=paper energy.limit_weight=2"

Several actors: `motion=[a.npz,b.npz]`. Writes `OUT.csv` and `OUT.png`.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from omegaconf import MISSING
from rankings import EQUAL, UNKNOWN, VERDICTS, RankedTrack, Ranking, ranking_of

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.files import csv_text, write_file
from sogjax.io.motion import load_motion
from sogjax.model.body import Body
from sogjax.run.recordings import file_list, opened
from sogjax.run.terminal import say
from sogjax.study.script import HELP, machine_line, run_script, settings_from
from sogjax.study.table import ruled_table
from sogjax.view.charts import REFERENCE, WRONG, grid, new_figure, png

MM, PERCENT = 1000.0, 100.0


def ranking_chart(rankings: Sequence[Ranking]) -> bytes:
    """Differences of energies, joint errors and errors of limbs over the frames, a column for each set of terms.

    The limbs are those that are lost by the tracked poses or the optima at the truth.
    """
    figure = new_figure(5.2 * len(rankings), 7.4)
    panels = figure.subplots(3, len(rankings), squeeze=False, sharex=True, sharey="row")
    for (worth, errors, limbs), ranking in zip(panels.T, rankings, strict=True):
        frames, gain = ranking.frames, PERCENT * ranking.gain
        worth.set_title(ranking.name, fontsize=9)
        worth.axhline(0.0, color=REFERENCE, linewidth=0.8)
        worth.fill_between(frames, 0.0, gain, where=gain < 0.0, color=WRONG, alpha=0.25, linewidth=0)
        worth.plot(frames, gain, color="black", linewidth=1.6, label="energy")
        for name, curve in ranking.gain_by_term.items():
            worth.plot(frames, PERCENT * curve, linewidth=1.0, label=name)
        for name, of_poses in (
            ("tracked", ranking.tracked),
            ("optimum above the tracked pose", ranking.reached),
            ("optimum above the true pose", ranking.optimum),
            ("true pose of this skeleton", ranking.fitted),
        ):
            errors.plot(frames, MM * of_poses.mean, label=name, linewidth=1.2)
        differ = np.flatnonzero((ranking.lost | (ranking.optimum.limbs > ranking.far)).any(axis=0))
        for number, k in enumerate(differ):
            look = {"color": f"C{number}", "linewidth": 1.2}
            limbs.plot(frames, MM * ranking.tracked.limbs[:, k], "-", label=ranking.tracked.names[k], **look)
            limbs.plot(frames, MM * ranking.optimum.limbs[:, k], "--", **look | {"linewidth": 1.0})
        worth.set_ylabel("true pose is worth more, %")
        errors.set_ylabel("mean joint error, mm")
        limbs.set(xlabel="frame", ylabel="limb (line: tracked, dashed:\noptimum at the truth), mm")
        grid(worth, legend=True)
        grid(errors, legend=True)
        grid(limbs, legend=bool(len(differ)))
    return png(figure)


def verdicts_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set: how many frames have which verdict, the smallest gain, and the mean joint errors."""
    titles = ["set", *VERDICTS, "wrong worth more", "least gain", "tracked, mm", "reached", "optimum", "fit"]
    lines = [titles]
    for ranking in rankings:
        counts = [str(ranking.verdicts.count(verdict)) for verdict in VERDICTS]
        known = ranking.gain[np.isfinite(ranking.gain)]
        least = f"{100.0 * known.min():+.2f} %" if known.size else "no truth"
        wrong = f"{np.sum(known < -EQUAL)} of {known.size}"
        errors = (ranking.tracked, ranking.reached, ranking.optimum, ranking.fitted)
        lines.append([ranking.name, *counts, wrong, least, *(_millimetres(each.mean) for each in errors)])
    meanings = "\n".join(f"{verdict}: {meaning}" for verdict, meaning in VERDICTS.items())
    return f"{ruled_table(lines)}\n\n{meanings}"


def oracle_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set: the truth as one more hypothesis beside the tracked pose, climbed from and judged as it is.

    How often the higher energy chooses the truth, by what share of the energy it is worth more, in all frames and in
    those with a lost limb, and the mean joint errors before and after the choice.
    """
    lines = [
        ["set", "frames", "truth chosen", "mean gain", "lost", "truth chosen", "mean gain", "reached, mm", "chosen"]
    ]
    for ranking in rankings:
        known = np.isfinite(ranking.gain)
        lost = known & ranking.lost.any(axis=1)
        errors = [_millimetres(each[known]) for each in (ranking.reached.mean, ranking.chosen)]
        lines.append([ranking.name, *_choice(ranking.gain[known]), *_choice(ranking.gain[lost]), *errors])
    return f"The truth as one more hypothesis, chosen where it is worth more after the climb:\n\n{ruled_table(lines)}"


def _choice(gains: Float[np.ndarray, "frame"]) -> list[str]:
    """How many frames, in what share of them the truth is worth more, and by how much on average."""
    if not gains.size:
        return ["0", "", ""]
    return [str(gains.size), f"{100.0 * np.mean(gains > EQUAL):.0f} %", f"{100.0 * gains.mean():+.3f} %"]


def limbs_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set and lost limb: where it was lost, and the verdicts of those frames."""
    lines = [["set", "limb", "frames", "lost in", *list(VERDICTS)[1:], "tracked, mm", "reached", "optimum"]]
    for ranking in rankings:
        for limb in np.flatnonzero(ranking.lost.any(axis=0)):
            of_limb = ranking.of_limb(int(limb))
            rows = np.flatnonzero(of_limb.lost[:, 0])
            counts = [str(of_limb.verdicts.count(verdict)) for verdict in list(VERDICTS)[1:]]
            span = f"{ranking.frames[rows[0]]} to {ranking.frames[rows[-1]]}"
            errors = [each.limbs[rows, 0] for each in (of_limb.tracked, of_limb.reached, of_limb.optimum)]
            name = of_limb.tracked.names[0]
            lines.append([ranking.name, name, span, str(len(rows)), *counts, *(_millimetres(each) for each in errors)])
    return ruled_table(lines) if len(lines) > 1 else "No limb is lost."


def terms_table(rankings: Sequence[Ranking]) -> str:
    """A line for each set: by what share of the energy the truth is worth more in frames with a loss, term by term."""
    names = list(dict.fromkeys(name for ranking in rankings for name in ranking.pair.true.parts))
    lines = [["gain of the true pose where a limb is lost, %", "energy", *names]]
    for ranking in rankings:
        rows = ranking.lost.any(axis=1) & np.isfinite(ranking.gain)
        if rows.any():
            by_term = ranking.gain_by_term
            gains = [f"{100.0 * by_term[name][rows].mean():+.3f}" if name in by_term else "" for name in names]
            lines.append([ranking.name, f"{100.0 * ranking.gain[rows].mean():+.3f}", *gains])
    return ruled_table(lines) if len(lines) > 1 else "No frame has a loss."


def write_csv(path: Path, rankings: Sequence[Ranking]) -> None:
    """A row for each set and frame: verdict, energies, what each term adds to either, errors in millimetres."""
    terms = list(dict.fromkeys(name for ranking in rankings for name in ranking.pair.true.parts))
    limbs = rankings[0].tracked.names if rankings else ()
    sides = ("tracked", "reached", "optimum", "fitted")
    head = ["set", "frame", "verdict", "gain", "energy tracked", "energy true"]
    head += [f"{term} {side}" for term in terms for side in ("tracked", "true")]
    head += [f"{side} mm" for side in sides] + [f"{limb} {side} mm" for limb in limbs for side in sides[:3]]
    lines = [
        [ranking.name, frame, ranking.verdicts[k], *_numbers(ranking, k, terms)]
        for ranking in rankings
        for k, frame in enumerate(ranking.frames)
    ]
    write_file(path, csv_text([head, *lines]))


def _numbers(ranking: Ranking, frame: int, terms: Sequence[str]) -> list[str]:
    true, tracked = ranking.pair.true, ranking.pair.tracked
    if ranking.verdicts[frame] == UNKNOWN:
        return []
    values = [ranking.gain[frame], tracked.energy[frame], true.energy[frame]]
    for term in terms:
        values += [side.parts[term][frame] if term in side.parts else np.nan for side in (tracked, true)]
    errors = (ranking.tracked, ranking.reached, ranking.optimum, ranking.fitted)
    lengths = [MM * each.mean[frame] for each in errors]
    lengths += [MM * each.limbs[frame, k] for k in range(len(ranking.tracked.names)) for each in errors[:3]]
    return [f"{value:.7g}" for value in values] + [f"{value:.1f}" for value in lengths]


def _millimetres(values: np.ndarray) -> str:
    present = values[np.isfinite(values)]
    return f"{MM * present.mean():.1f}" if present.size else ""


@dataclass
class Settings:
    """What is compared, as `key=value` on the command line."""

    recording: str = MISSING
    motion: Any = MISSING
    """A file, or a list of those of several actors."""
    actor: Any = None
    """Theirs; null: beside the motions."""
    out: str = "ranking"
    far: float = 0.1
    """Metres: a limb that is farther off is lost."""
    every: int = 1
    """Of how many frames one is looked at."""
    sets: list[str] = field(default_factory=lambda: ["default"])


def main() -> None:
    """Print the tables, and write the files."""
    settings = settings_from(Settings, _with_sets(sys.argv[1:]))
    if settings.every < 1:
        raise InputError(f"every={settings.every}: give 1 or more")
    motions = [load_motion(path) for path in file_list(settings.motion)]
    recording = opened(settings.recording)
    track = RankedTrack.of(recording, motions, [*_actors(settings)])
    rankings = []
    for words in settings.sets:
        say(f"{words}: climbing in {len(track.frames[:: settings.every])} frames")
        rankings.append(ranking_of(track, words, settings.far, settings.every))
    tables = (oracle_table, verdicts_table, limbs_table, terms_table)
    print(machine_line(), *(table(rankings) for table in tables), sep="\n\n")
    write_csv(Path(f"{settings.out}.csv"), rankings)
    write_file(Path(f"{settings.out}.png"), ranking_chart(rankings))
    print(f"\n{settings.out}.csv\n{settings.out}.png")


def _actors(settings: Settings) -> list[Body]:
    """The actors of the motions: their files, else those that the run wrote beside the motions."""
    if settings.actor is not None:
        return [load_body(path) for path in file_list(settings.actor)]
    motions = file_list(settings.motion)
    return [load_body(path.with_name(path.stem.replace("motion", "actor", 1) + ".yaml")) for path in motions]


def _with_sets(words: list[str]) -> list[str]:
    """The words of a command line, where those that are no setting of the script are its sets."""
    known = {entry.name for entry in fields(Settings)}
    own = [word for word in words if word in HELP or (" " not in word and word.partition("=")[0] in known)]
    sets = [word for word in words if word not in own]
    return [*own, f"sets={json.dumps(sets)}"] if sets else own


if __name__ == "__main__":
    run_script(main)
