"""What comes out of whole runs, as a user makes them, on recordings of people and rooms that nothing was chosen on?

    python experiments/whole_runs.py [rows=['talk 2 4 plates 22']] [out=outputs/whole_runs] [update=true] [fit=true]

A row is: motion, people, cameras, what is given beside the videos (`plates`: pictures of the empty scene and example
poses; `poses`: example poses; `videos`: nothing), the seed of people, clothes and room, and settings of `sogjax synth`.
Each recording is rendered, `sogjax track` is run on it without a pose, and its motions are held against the truth. Runs
are kept in `out` and not made again. The table is printed, with how often verdicts hold, and written as table.md. With
`update`, `whole_runs.csv`, which has every recording as it was last run, is brought up to date, and what it says in all
is printed. With `fit` the weight by which rivals of limbs count is fitted to the limbs of these runs, and written
into `sogjax/quality/fitted.yaml`; what is printed of it judges each run by the weight that comes from the others.
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
from beside_truth import FAR, OFTEN, beside_truth
from limb_doubt import change_part
from scipy.optimize import linear_sum_assignment

from sogjax.errors import InputError
from sogjax.io.background_cache import VARIABLE
from sogjax.io.cache_folder import OFF
from sogjax.io.files import csv_text, write_file, write_json
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion, load_motion
from sogjax.io.recording_files import BACKGROUND, CALIBRATION, EXAMPLE_POSES, GROUND_TRUTH, SETTINGS, VIDEOS
from sogjax.quality.fitted import PATH, fitted_numbers
from sogjax.quality.limb_confidence import SURE, beside_rivals
from sogjax.quality.limb_warnings import doubtful_limbs
from sogjax.quality.markers import common_frames, joint_errors
from sogjax.quality.metrics import mean_per_frame
from sogjax.quality.verdict import Verdict
from sogjax.run.run_files import METRICS, MOTION
from sogjax.study.experiment import synth_settings
from sogjax.study.limb_calibration import area_under_roc
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
WEIGHTS = [0.1 * k for k in range(200)]
"""Of rivals, one of which is chosen."""
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
    """Fit the weight of rivals to the limbs of runs and write it; how well each is judged by that of the others."""
    limbs = [np.concatenate([np.zeros((3, 0)), *_measured(run)], axis=1) for run in runs]
    limbs = [of_run for of_run in limbs if of_run.size]
    unlike, _, error = np.concatenate(limbs or [np.zeros((3, 0))], axis=1)
    if not (error > FAR).any():
        raise InputError("fit=true: no limb of these runs is lost; give more rows")
    others = lambda left: [of_run for k, of_run in enumerate(limbs) if k != left] or limbs
    said = [beside_rivals(of_run[0], of_run[1], likeliest_weight(others(k))) for k, of_run in enumerate(limbs)]
    count = f"{len(limbs)} runs; {len(error)} limbs, {int((error > FAR).sum())} lost"

    def refit(part: dict) -> None:
        part["values"], part["recordings"] = {"weight": round(likeliest_weight(limbs), 1)}, count

    change_part(path, "rivals", refit)
    by_both = {"as it is seen": unlike, "beside rivals": np.concatenate(said)}
    return [count, *(_noticed(name, doubt, error > FAR) for name, doubt in by_both.items())]


def likeliest_weight(limbs: Sequence[np.ndarray]) -> float:
    """The weight of rivals with which what was lost of limbs is likeliest."""
    unlike, rival, error = np.concatenate([*limbs], axis=1)

    def surprise(weight: float) -> float:
        doubt = np.clip(beside_rivals(unlike, rival, weight), SURE, 1.0 - SURE)
        return -float(np.mean(np.log(np.where(error > FAR, doubt, 1.0 - doubt))))

    return min(WEIGHTS, key=surprise)


def _measured(run: dict) -> list[np.ndarray]:
    return [np.array(values) for actor in run["actors"] for values in actor.get("limbs", {}).values()]


def _noticed(name: str, said: np.ndarray, wrong: np.ndarray) -> str:
    named = said > fitted_numbers().verdict.limb_doubtful
    shares = (
        f"{100 * named[wrong].mean():.0f} % of the lost are named, {100 * named[~wrong].mean():.2f} % of the others"
    )
    return f"- {name}: area under the ROC {area_under_roc(said, wrong):.3f}; {shares}"


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
