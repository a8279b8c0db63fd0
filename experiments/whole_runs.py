"""What comes out of whole runs, as a user makes them, on recordings of people and rooms that nothing was chosen on?

    python experiments/whole_runs.py [rows=['talk 2 4 plates 22']] [out=outputs/whole_runs]

A row is: motion, people, cameras, what is given beside the videos (`plates`: pictures of the empty scene and example
poses; `poses`: example poses; `videos`: nothing), the seed of people, clothes and room, and settings of `sogjax synth`.
Each recording is rendered, `sogjax track` is run on it without a pose, and its motions are held against the truth. Runs
are kept in `out` and not made again. The table is printed, with how often verdicts hold, and written as table.md.
"""

import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np
from beside_truth import OFTEN, beside_truth
from scipy.optimize import linear_sum_assignment

from sogjax.errors import InputError
from sogjax.io.background_cache import VARIABLE
from sogjax.io.cache_folder import OFF
from sogjax.io.files import write_file, write_json
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion, load_motion
from sogjax.io.recording_files import BACKGROUND, CALIBRATION, EXAMPLE_POSES, GROUND_TRUTH, SETTINGS, VIDEOS
from sogjax.quality.limb_warnings import doubtful_limbs
from sogjax.quality.verdict import Verdict
from sogjax.run.run_files import METRICS, MOTION
from sogjax.study.experiment import synth_settings
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.synth.cache import cached_recording

ROWS = (
    "talk 2 12 plates 21",
    "talk 2 4 plates 22",
    "fight 2 12 plates 23",
    "fight 2 4 plates 24",
    "embrace 2 12 poses 25",
    "embrace 2 12 videos 26",
    "hug 2 4 plates 28",
    "couple 2 12 plates 29",
    "dance 1 4 plates 30",
    "sit 1 4 plates 31",
    "sit 1 12 poses 32",
    "sit 1 12 videos 33",
    "run 1 12 poses 34",
    "talk 2 12 videos 35",
    "arms 1 12 poses 36",
    "stoop 1 12 videos 37",
    "cartwheel 1 4 plates 38",
    "arms 1 12 videos 39",
    "throw 1 12 videos 40",
    "walk 1 4 videos 41",
    "pass 2 4 plates 42",
    "walk 1 12 plates 43 props=board",
    "talk 2 12 plates 44 props=counter",
    "squat_kick 1 4 poses 45",
    "run 1 4 plates 46",
    "sit 1 4 plates 61",
    "cartwheel 1 4 plates 54",
    "pass 2 4 plates 52",
    "talk 2 4 plates 66",
    "stoop 1 12 videos 55",
    "embrace 2 12 videos 56",
    "sit 1 12 plates 57",
    "pass 2 12 plates 51",
    "run 1 12 plates 59",
    "walk 1 4 plates 60",
    "sit 1 12 videos 58",
    "cartwheel 1 4 poses 70",
    "hug 2 12 videos 65",
    "arms 1 4 plates 64",
    "dance 1 4 plates 63",
    "fight 2 4 plates 67",
    "couple 2 4 plates 69",
    "cartwheel 1 12 plates 62",
    "talk 2 12 videos 53",
    "embrace 2 12 poses 71",
    "sit 1 12 poses 72",
    "talk 2 12 plates 73",
    "run 1 12 plates 74",
    "walk 1 6 videos 75",
    "fight 2 6 plates 76",
    "throw 1 4 plates 77",
    "squat_kick 1 12 videos 78",
    "dance 1 12 poses 79",
    "pass 2 12 videos 80",
    "stoop 1 4 poses 81",
    "hug 2 12 plates 82 props=counter",
    "couple 2 6 poses 83",
    "arms 1 6 videos 84",
    "cartwheel 1 6 plates 85",
    "sit 1 6 plates 86",
    "squat_kick 1 4 videos 91",
    "stoop 1 4 videos 92",
    "arms 1 4 videos 93",
    "sit 1 12 videos 101",
    "talk 2 12 plates 102",
    "embrace 2 12 poses 103",
    "cartwheel 1 4 plates 104",
    "stoop 1 12 videos 105",
    "run 1 12 plates 106",
    "sit 1 12 plates 107",
    "sit 1 12 poses 108",
    "hug 2 4 plates 109",
    "walk 1 4 videos 110",
    "squat_kick 1 12 videos 111",
    "arms 1 4 plates 112",
    "dance 1 6 poses 113",
    "fight 2 12 poses 114",
    "couple 2 12 plates 115",
    "pass 2 6 videos 116",
    "throw 1 12 videos 117",
    "run 1 4 plates 118",
    "cartwheel 1 12 videos 119",
    "talk 2 6 plates 120",
    "talk 2 4 plates 131",
    "embrace 2 12 poses 132",
    "sit 1 12 plates 133",
    "run 1 12 poses 134",
    "cartwheel 1 4 plates 135",
    "stoop 1 12 videos 136",
    "talk 2 12 plates 137",
    "fight 2 4 plates 138",
    "sit 1 12 videos 139",
    "arms 1 6 videos 140",
    "couple 2 6 plates 141",
    "throw 1 4 poses 142",
    "dance 1 6 poses 143",
    "pass 2 12 videos 144",
    "walk 1 12 plates 145 props=counter",
    "hug 2 12 poses 146",
    "squat_kick 1 4 plates 147",
    "run 1 6 plates 148",
    "sit 1 6 plates 149",
    "embrace 2 4 plates 150",
    "arms 1 4 plates 151",
    "cartwheel 1 12 poses 152",
    "talk 2 4 plates 161",
    "dance 1 4 plates 162",
    "throw 1 4 videos 163",
    "couple 2 4 plates 164",
    "talk 2 4 plates 171",
    "talk 2 6 plates 172",
    "couple 2 4 plates 173",
    "dance 1 4 plates 174",
    "embrace 2 6 plates 175",
    "hug 2 4 plates 176",
    "run 1 4 plates 177",
    "fight 2 6 plates 178",
    "cartwheel 1 4 plates 179",
    "sit 1 12 videos 180",
    "talk 2 4 plates 181",
    "couple 2 4 plates 182",
    "embrace 2 4 plates 183",
    "fight 2 4 plates 184",
    "hug 2 6 videos 185",
    "pass 2 4 plates 186",
    "talk 2 12 videos 187",
    "throw 1 4 plates 188",
    "arms 1 6 videos 189",
    "couple 2 12 plates 190",
    "squat_kick 1 6 plates 191",
    "talk 2 12 videos 192",
    "hug 2 12 videos 193",
    "couple 2 12 videos 194",
    "fight 2 12 videos 195",
    "sit 1 12 videos 196",
    "arms 1 4 videos 197",
    "fight 2 4 plates 203",
    "couple 2 4 plates 204",
    "talk 2 4 plates 205",
    "hug 2 6 videos 206",
    "dance 1 4 plates 208",
    "sit 1 12 videos 209",
    "sit 1 4 plates 210",
    "run 1 4 videos 211",
    "walk 1 4 videos 212",
    "cartwheel 1 4 poses 213",
    "throw 1 4 plates 214",
    "arms 1 4 videos 215",
    "stoop 1 6 videos 216",
    "squat_kick 1 4 videos 217",
    "walk 1 12 plates 218 props=counter",
    "sit 1 6 poses 219",
    "run 1 12 videos 220",
    "dance 1 6 videos 221",
    "throw 1 6 videos 222",
    "arms 1 12 videos 223",
    "cartwheel 1 12 videos 224",
    "hug 2 4 plates 225",
    "embrace 2 6 plates 226",
    "talk 2 6 plates 227",
    "stoop 1 4 poses 228",
    "talk 2 12 plates 229",
    "walk 1 4 plates 230",
    "talk 2 12 plates 231",
    "talk 2 4 plates 232",
    "embrace 2 12 videos 233",
    "sit 1 12 plates 234",
    "sit 1 12 videos 235",
    "run 1 12 plates 236",
    "cartwheel 1 4 plates 237",
    "walk 1 3 plates 241",
    "hug 2 12 videos 251",
    "fight 2 6 videos 252",
    "talk 2 6 videos 253",
    "sit 1 6 videos 254",
    "pass 2 4 videos 256",
    "couple 2 6 videos 262",
    "talk 2 6 videos 264",
    "talk 2 12 plates 301",
    "sit 1 12 videos 302",
    "run 1 12 videos 303",
    "embrace 2 12 plates 304",
    "cartwheel 1 4 plates 305",
    "walk 1 6 videos 306",
    "walk 3 12 videos 308",
    "hug 2 8 videos 319 outfit=striped",
    "stoop 1 12 videos 321",
    "couple 2 12 videos 322",
    "run 1 12 plates 323",
    "cartwheel 1 12 videos 324",
    "hug 2 6 plates 325",
    "sit 1 6 plates 326",
    "arms 1 12 videos 327",
    "embrace 2 12 plates 330 outfit=black_suit",
    "sit 1 12 plates 332 room=camouflage",
    "talk 2 12 plates 333 props=table",
    "walk 2 12 videos 334",
    "walk 1 5 videos 335 distortion=-0.2",
    "couple 2 12 videos 336 outfit=long_sleeves",
    "arms 1 3 plates 337",
    "throw 1 12 videos 338 outfit=black_suit",
    "dance 1 12 plates 339 props=screen",
    "walk 1 4 plates 341",
    "hug 2 12 plates 342",
    "sit 1 12 plates 343",
    "run 1 6 plates 344",
    "talk 2 12 videos 345",
    "stoop 1 6 plates 346",
    "cartwheel 1 12 plates 347",
    "fight 2 12 plates 348",
    "squat_kick 1 12 videos 349",
    "couple 2 12 plates 350 outfit=black_suit",
    "throw 1 6 plates 351",
    "dance 1 12 videos 352",
    "pass 2 12 videos 353",
    "walk 1 12 plates 354 props=screen",
    "embrace 2 12 videos 355",
    "run 1 4 plates 356",
    "arms 1 6 videos 357",
    "talk 2 12 plates 358 props=counter",
    "squat_kick 1 6 plates 359",
    "walk 2 6 plates 360",
    "sit 1 12 plates 361",
    "walk 1 12 poses 362",
    "cartwheel 1 6 plates 363",
    "arms 1 12 plates 364 props=screen",
    "run 1 12 videos 365 outfit=black_suit",
    "dance 1 6 plates 366",
    "throw 1 4 plates 367",
    "stoop 1 12 poses 368",
    "squat_kick 1 4 plates 369",
    "walk 1 12 videos 370 room=camouflage",
    "talk 2 6 plates 371",
    "hug 2 12 videos 372",
    "couple 2 4 plates 373",
    "pass 2 12 plates 374",
    "fight 2 12 videos 375",
    "embrace 2 6 plates 376",
    "walk 3 12 plates 377",
)
GIVEN = {
    "plates": (SETTINGS, BACKGROUND, EXAMPLE_POSES),
    "poses": (SETTINGS, EXAMPLE_POSES),
    "videos": (),
}
COLUMNS = ("recording", "joints, mm", "a joint > 15 cm off, % of frames", "verdict")
BOUNDS, LEAST = (0.2, 0.3, 0.35, 0.4, 0.5, 0.6, 0.7), (3, 4, 5)
"""Of how likely a limb is lost, from which it could be named, and the frames for which it must be so."""
SHOWN = ((1e3, "mean"), (100, "astray"))
LEAN = ("outputs.rerun=false", "outputs.overlay=false", "overwrite=true")


@dataclass
class Settings:
    """What is run, as `key=value` on the command line."""

    rows: list[str] = field(default_factory=lambda: [*ROWS])
    frames: int = 60
    out: str = "outputs/whole_runs"


def main() -> None:
    """Run what is not there yet, and write the table."""
    settings = settings_from(Settings)
    head = [machine_line(), "", f"| {' | '.join(COLUMNS)} |", "|---" * len(COLUMNS) + "|"]
    runs, lines = [], []
    for row in settings.rows:
        name = f"{row} {settings.frames}".replace(" ", "_").replace("=", "-")
        folder = Path(settings.out) / name
        runs.append(_kept(folder) or _run(row, settings.frames, folder))
        lines.append(_line(row, runs[-1]))
        print(lines[-1], flush=True)
    text = "\n".join([*head, *lines, "", *_of_verdicts(runs)]) + "\n"
    write_file(Path(settings.out) / "table.md", text)
    print(f"\n{text}")


def _line(row: str, run: dict) -> str:
    actors = run["actors"]
    means, astray = (" / ".join(f"{scale * one[key]:.0f}" for one in actors) for scale, key in SHOWN)
    said = "; ".join(dict.fromkeys(one["sentence"] for one in actors)) or f"refused: {run['refused']}"
    return f"| {row} | {means} | {astray} | {said} |"


def _kept(folder: Path) -> dict | None:
    path = folder / "found.json"
    found = _read(path) if path.is_file() else {}
    return found if all("longest" in actor for actor in found.get("actors", [{}])) else None


def _read(path: Path) -> dict:
    return json.loads(path.read_text(encoding="utf-8"))


def _run(row: str, frames: int, folder: Path) -> dict:
    """Render, track and compare; what was found is kept in the folder."""
    try:
        motion, actors, cameras, given, seed, *more = row.split()
        chosen = dict(pair.split("=") for pair in more)
        numbers = {"actors": int(actors), "cameras": int(cameras), "seed": int(seed), "frames": frames}
        files = GIVEN[given]
    except (ValueError, KeyError) as error:
        raise InputError(f"rows: {row}: write MOTION PEOPLE CAMERAS {'|'.join(GIVEN)} SEED [SETTING=VALUE]") from error
    rendered = cached_recording(synth_settings({"motion": motion, **numbers, **chosen}))
    recording, results = folder / "recording", folder / "results"
    recording.mkdir(parents=True, exist_ok=True)
    for file in (VIDEOS, CALIBRATION, *files):
        path = file.of(recording)
        if not path.is_symlink():
            path.symlink_to(file.of(rendered), file.is_folder)
    people = (f"actors={actors}",) if given == "videos" and numbers["actors"] > 1 else ()
    command = [sys.executable, "-m", "sogjax", "track", f"recording={recording}", f"out={results}", *LEAN, *people]
    unkept = os.environ | {VARIABLE: OFF}  # a background of an earlier program is none of this one's
    ran = subprocess.run(command, capture_output=True, text=True, check=False, env=unkept)
    write_file(folder / "log.txt", ran.stdout + ran.stderr)
    if ran.returncode:
        said = next((line for line in ran.stderr.splitlines() if line.startswith("sogjax:")), "failed; see log.txt")
        found = {"actors": [], "refused": said.removeprefix("sogjax: ")}
    else:
        found = {"actors": _actors(results, GROUND_TRUTH.of(rendered)), "refused": ""}
    write_json(folder / "found.json", found)
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
    longest = {f"{bound:g}": max(map(frames, doubtful_limbs(motion, bound, 1)), default=0) for bound in BOUNDS}
    return asdict(beside) | said | {"named": named, "longest": longest}


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
