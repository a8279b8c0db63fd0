"""What comes out of whole runs, as a user makes them, on recordings of people and rooms that nothing was chosen on?

    python experiments/whole_runs.py [rows=['talk 2 4 plates 22']] [out=outputs/whole_runs] [update=true] [fit=true]

A row is: motion, people, cameras, what is given beside the videos (`plates`: pictures of the empty scene and example
poses; `poses`: example poses; `videos`: nothing), the seed of people, clothes and room, and settings of `sogjax synth`.
Each recording is rendered, `sogjax track` is run on it without a pose, and its motions are held against the truth. Runs
are kept in `out` and not made again. The table is printed, with how often verdicts hold, and written as table.md. With
`update`, `whole_runs.csv`, which has every recording as it was last run, is brought up to date, and what it says in all
is printed. With `fit` what rivals of limbs count is chosen by the actors of these runs, and written into
`sogjax/quality/fitted.yaml`.
"""

import csv
import datetime
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from beside_truth import OFTEN, beside_truth
from limb_doubt import change_part
from scipy.optimize import linear_sum_assignment

from sogjax.errors import InputError
from sogjax.io.background_cache import VARIABLE
from sogjax.io.cache_folder import OFF
from sogjax.io.files import csv_text, write_file, write_json
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion, load_motion
from sogjax.io.recording_files import BACKGROUND, CALIBRATION, EXAMPLE_POSES, GROUND_TRUTH, SETTINGS, VIDEOS
from sogjax.quality.fitted import PATH
from sogjax.quality.limb_confidence import beside_rivals
from sogjax.quality.limb_warnings import AT_LEAST, GAP, doubtful_limbs
from sogjax.quality.markers import common_frames, joint_errors
from sogjax.quality.metrics import mean_per_frame, stretches
from sogjax.quality.verdict import Verdict
from sogjax.run.run_files import METRICS, MOTION
from sogjax.study.experiment import synth_settings
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.true_poses import limb_of
from sogjax.synth.cache import cached_recording

TABLE = Path(__file__).with_suffix(".csv")
"""What each recording came to when it was last run, and when that was."""
GIVEN = {
    "plates": (SETTINGS, BACKGROUND, EXAMPLE_POSES),
    "poses": (SETTINGS, EXAMPLE_POSES),
    "videos": (),
}
COLUMNS = ("recording", "joints, mm", "a joint > 15 cm off, % of frames", "verdict")
FIELDS = ("recording", "joints_mm", "astray_percent", "silent", "doubted", "verdict", "date")
"""Columns of the table. Silent: actors with a joint astray whom the verdict calls right; doubted: those with none whom
it doubts; both are empty where they were not kept."""
GROUPS = ((10, "10 to 12"), (5, "5 to 8"), (0, "3 or 4"))
"""Cameras from which on a group of recordings begins, and its name."""
BOUNDS, LEAST = (0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5), (3, 4, 5)
"""Of how likely a limb is lost, from which it could be named, and the frames for which it must be so."""
CHOICES, COSTS = [(0.5 * k, bound) for k in range(17) for bound in BOUNDS], (2, 1)
"""Weights of rivals and bounds of which one is chosen; what a loss that is not told and a wrong doubt count."""
SHOWN = ((1e3, "mean"), (100, "astray"))
FOUND = "found.json"
LEAN = ("outputs.rerun=false", "outputs.overlay=false", "overwrite=true")


@dataclass
class Settings:
    """What is run, as `key=value` on the command line."""

    rows: list[str] = field(default_factory=list)
    """None: all of the table."""
    frames: int = 60
    out: str = "outputs/whole_runs"
    update: bool = False
    fit: bool = False


def main() -> None:
    """Run what is not there yet, and write the table."""
    settings, table = settings_from(Settings), _table()
    if settings.update and settings.frames != Settings.frames:
        raise InputError(f"update=true: the table is of {Settings.frames} frames; leave frames={settings.frames} out")
    head = [machine_line(), "", f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|"]
    runs, lines = [], []
    for row in settings.rows or [*table]:
        name = f"{row} {settings.frames}".replace(" ", "_").replace("=", "-")
        folder = Path(settings.out) / name
        runs.append(_kept(folder) or _run(row, settings.frames, folder))
        table[row] = _entry(row, runs[-1], folder)
        lines.append(_line(row, runs[-1]))
        print(lines[-1], flush=True)
    text = "\n".join([*head, *lines, "", *_of_verdicts(runs)]) + "\n"
    write_file(Path(settings.out) / "table.md", text)
    print(f"\n{text}")
    if settings.fit:
        print("\n".join(fit_rivals(PATH, runs)), flush=True)
    if settings.update:
        write_file(TABLE, csv_text([FIELDS, *([entry[name] for name in FIELDS] for entry in table.values())]))
        print("\n".join(_in_all(table)))


def _table() -> dict[str, dict[str, str]]:
    """What each recording came to, in the order of the table."""
    with TABLE.open(encoding="utf-8", newline="") as file:
        return {entry["recording"]: entry for entry in csv.DictReader(file)}


def _entry(row: str, run: dict, folder: Path) -> dict[str, str]:
    """A line of the table."""
    ran = datetime.date.fromtimestamp((folder / FOUND).stat().st_mtime).isoformat()
    _, means, astray, said = _cells(row, run)
    wrong = [one["astray"] > OFTEN for one in run["actors"]]
    right = [one["looks_right"] for one in run["actors"]]
    silent = sum(off and fine for off, fine in zip(wrong, right, strict=True))
    doubted = sum(not off and not fine for off, fine in zip(wrong, right, strict=True))
    counts = map(str, (silent, doubted) if run["actors"] else ("", ""))
    return dict(zip(FIELDS, (row, means, astray, *counts, said, ran), strict=True))


def _in_all(table: dict[str, dict[str, str]]) -> list[str]:
    """The table by what is given and the number of cameras, as Markdown."""
    heads = ("given, cameras", "recordings", "joints: median", "nine of ten", "actors", "astray", "silent", "doubted")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    for given in GIVEN:
        for k, (least, name) in enumerate(GROUPS):
            most = GROUPS[k - 1][0] if k else np.inf
            some = [e for row, e in table.items() if row.split()[3] == given and least <= int(row.split()[2]) < most]
            lines.append(f"| {given}, {name} | {_of_group(some)} |")
    return [*lines, f"| all | {_of_group([*table.values()])} |"]


def _of_group(entries: list[dict[str, str]]) -> str:
    """Of all recordings how far joints are off (mm); of those whose verdict was kept the actors, and what it says."""
    numbers = lambda text: [float(part) for part in text.split("/")] if text.strip() else []
    joints = [value for entry in entries for value in numbers(entry["joints_mm"])] or [np.nan]
    kept = [entry for entry in entries if entry["silent"]]
    shares = [value for entry in kept for value in numbers(entry["astray_percent"])]
    silent, doubted = (sum(int(entry[key]) for entry in kept) for key in ("silent", "doubted"))
    wrong = sum(share > 100 * OFTEN for share in shares)
    middle, high = np.percentile(joints, [50, 90])
    return f"{len(entries)} | {middle:.0f} | {high:.0f} | {len(shares)} | {wrong} | {silent} | {doubted}"


def _cells(row: str, run: dict) -> tuple[str, str, str, str]:
    actors = run["actors"]
    means, astray = (" / ".join(f"{scale * one[key]:.0f}" for one in actors) for scale, key in SHOWN)
    return row, means, astray, "; ".join(one["sentence"] for one in actors) or f"refused: {run['refused']}"


def _line(row: str, run: dict) -> str:
    return f"| {' | '.join(_cells(row, run))} |"


def _kept(folder: Path) -> dict | None:
    path = folder / FOUND
    found = _read(path) if path.is_file() else {}
    bounds = {f"{bound:g}" for bound in BOUNDS}
    known = lambda actor: "limbs" in actor and bounds <= {*actor.get("longest", {})}
    return found if all(map(known, found.get("actors", [{}]))) else None


def _read(path: Path) -> dict:
    return json.loads(path.read_text(encoding="utf-8"))


def linked_recording(row: str, frames: int, folder: Path) -> tuple[Path, Path]:
    """The recording of a row, with what is given beside its videos, and the whole one that was rendered.

    Raises:
        InputError: the row is none.
    """
    try:
        motion, actors, cameras, given, seed, *more = row.split()
        chosen = dict(pair.split("=") for pair in more)
        numbers = {"actors": int(actors), "cameras": int(cameras), "seed": int(seed), "frames": frames}
        files = GIVEN[given]
    except (ValueError, KeyError) as error:
        raise InputError(f"rows: {row}: write MOTION PEOPLE CAMERAS {'|'.join(GIVEN)} SEED [SETTING=VALUE]") from error
    rendered = cached_recording(synth_settings({"motion": motion, **numbers, **chosen}))
    recording = folder / "recording"
    recording.mkdir(parents=True, exist_ok=True)
    for file in (VIDEOS, CALIBRATION, *files):
        path = file.of(recording)
        if not path.is_symlink():
            path.symlink_to(file.of(rendered), file.is_folder)
    return recording, rendered


def _run(row: str, frames: int, folder: Path) -> dict:
    """Render, track and compare; what was found is kept in the folder."""
    recording, rendered = linked_recording(row, frames, folder)
    _, actors, _, given, *_ = row.split()
    people = (f"actors={actors}",) if given == "videos" and int(actors) > 1 else ()
    results = folder / "results"
    command = [sys.executable, "-m", "sogjax", "track", f"recording={recording}", f"out={results}", *LEAN, *people]
    unkept = os.environ | {VARIABLE: OFF}  # a background of an earlier program is none of this one's
    ran = subprocess.run(command, capture_output=True, text=True, check=False, env=unkept)
    write_file(folder / "log.txt", ran.stdout + ran.stderr)
    if ran.returncode:
        said = next((line for line in ran.stderr.splitlines() if line.startswith("sogjax:")), "failed; see log.txt")
        found = {"actors": [], "refused": said.removeprefix("sogjax: ")}
    else:
        found = {"actors": _actors(results, GROUND_TRUTH.of(rendered)), "refused": ""}
    write_json(folder / FOUND, found)
    return found


def _actors(results: Path, truth: Path) -> list[dict]:
    """Each motion held against the person that it suits best: how far it is off, and what the run says of it."""
    known = load_ground_truth(truth)
    people = [known.subject(name) for name in known.subjects] if known.subjects else [known]
    verdicts = [Verdict.from_dict(entry) for entry in _read(results / METRICS.name)["verdicts"].values()]
    motions = [load_motion(MOTION.of(results, verdict.actor, len(verdicts))) for verdict in verdicts]
    errors = np.array([[_mean(motion, person) for person in people] for motion in motions])
    pairs = zip(*linear_sum_assignment(errors), strict=True)
    return [_actor(motions[row], people[column], verdicts[row]) for row, column in pairs]


def _mean(motion: Motion, person: GroundTruth) -> float:
    beside = beside_truth(motion, person)
    return float("inf") if beside is None else beside.mean


def _actor(motion: Motion, person: GroundTruth, verdict: Verdict) -> dict:
    beside = beside_truth(motion, person)
    assert beside is not None
    named = sorted({limb.name for limb in verdict.doubtful})
    said = {"sentence": verdict.sentence, "looks_right": verdict.looks_right, "subject_wrong": verdict.wrong}
    frames = lambda limb: limb.last_frame - limb.first_frame + 1
    limbs = limbs_beside(motion, person)
    longest = {f"{bound:g}": max(map(frames, doubtful_limbs(motion, bound, 1)), default=0) for bound in BOUNDS}
    return asdict(beside) | said | {"named": named, "longest": longest, "limbs": limbs}


def limbs_beside(motion: Motion, person: GroundTruth) -> dict[str, list[list[float]]]:
    """By limb, in each frame that the truth knows: how likely it is lost as it is seen, its rival's gain, its error."""
    errors = joint_errors(motion, person)
    if errors is None or motion.limb_unlike is None or motion.limb_rival is None or motion.limb_names is None:
        return {}
    rows, found = common_frames(motion, person)[0], {}
    for name, *measures in zip(motion.limb_names.tolist(), motion.limb_unlike.T, motion.limb_rival.T, strict=True):
        joints = [k for k, joint in enumerate(errors.names) if limb_of(joint) == name]
        values = np.stack([*(of_limb[rows] for of_limb in measures), mean_per_frame(errors.errors[:, joints])])
        found[name] = np.round(values[:, np.isfinite(values).all(axis=0)], 5).tolist()
    return {name: values for name, values in found.items() if values[0]}


def fit_rivals(path: Path, runs: Sequence[dict]) -> list[str]:
    """Choose what rivals count and from where limbs are named by the actors of runs, and write it; how well that does.

    What is told of it by others judges each run by what is chosen without it.
    """
    actors = [[_judged(actor) for actor in run["actors"] if actor.get("limbs")] for run in runs]
    wrong = sum(astray for of_run in actors for astray, _ in of_run)
    if not wrong:
        raise InputError("fit=true: nobody of these runs has a joint astray; give more rows")
    counts = np.array([[_mistakes(of_run, *choice) for choice in CHOICES] for of_run in actors])
    total, best = counts.sum(axis=0), lambda of: int(np.argmin(of @ COSTS))
    by_others = np.sum([of_run[best(total - of_run)] for of_run in counts], axis=0)
    weight, bound = CHOICES[best(total)]
    right, told = sum(map(len, actors)) - wrong, total[best(total)]
    count = f"{len(runs)} runs; {wrong + right} actors, {wrong} with a joint astray"

    def refit(part: dict) -> None:
        part["values"], part["recordings"] = {"weight": weight, "doubtful": bound}, count

    change_part(path, "rivals", refit)
    return [
        f"{count}: weight {weight:g}, named from {bound:g}",
        f"- a joint is astray, and no limb is named: {told[0]} of {wrong}, by others {by_others[0]}",
        f"- none is, and one is named: {told[1]} of {right}, by others {by_others[1]}",
    ]


def _judged(actor: dict) -> tuple[bool, list[np.ndarray]]:
    """Whether a joint of an actor is astray, and of each limb how it is seen and what its rival gains."""
    return actor["astray"] > OFTEN, [np.array(values)[:2] for values in actor["limbs"].values()]


def _mistakes(actors: Sequence[tuple[bool, list[np.ndarray]]], weight: float, bound: float) -> tuple[int, int]:
    """How many actors with a joint astray have no limb named, and how many others have one."""
    doubted = lambda limb: stretches(beside_rivals(limb[0], limb[1], weight) > bound, AT_LEAST, gap=GAP)
    named = [(astray, any(map(doubted, limbs))) for astray, limbs in actors]
    return sum(astray and not said for astray, said in named), sum(said and not astray for astray, said in named)


def _of_verdicts(runs: list[dict]) -> list[str]:
    """How often verdicts are silently wrong, and how often they doubt what is right: actors that were tracked."""
    actors = [actor for run in runs for actor in run["actors"]]
    wrong, right = [[one for one in actors if (one["astray"] > OFTEN) == off] for off in (True, False)]
    limbs = lambda one: {*one["lost"]} - {"trunk"}
    lost = [one for one in actors if limbs(one) and not one["subject_wrong"]]
    groups = {
        "a joint is astray, and it looks right": [one["looks_right"] for one in wrong],
        "none is, and it is doubted": [not one["looks_right"] for one in right],
        "a limb is lost, and one of these is named": [bool(limbs(one) & {*one["named"]}) for one in lost],
        "refused": [not run["actors"] for run in runs],
    }
    found = [f"- {name}: {sum(true)} of {len(true)}" for name, true in groups.items()]
    count = lambda some, bound, least, named: (
        f"{sum((one['longest'][f'{bound:g}'] >= least) == named for one in some)} of {len(some)}"
    )
    rows = [
        f"| {bound:g}, {least} | {count(wrong, bound, least, False)} | {count(right, bound, least, True)} |"
        for bound in BOUNDS
        for least in LEAST
    ]
    head = "| a limb is named from, for frames | a joint is astray, and none is named | none is, and one is named |"
    return [*found, "", head, "|---|---|---|", *rows]


if __name__ == "__main__":
    run_script(main)
