"""What comes out of whole runs, as a user makes them, on recordings of people and rooms that nothing was chosen on?

    python experiments/whole_runs.py [rows=['talk 2 4 plates 22']] [out=outputs/whole_runs]

A row is: motion, people, cameras, what is given beside the videos (`plates`: pictures of the empty scene and example
poses; `poses`: example poses; `videos`: nothing), the seed of people, clothes and room, and settings of `sogjax synth`.
Each recording is rendered, `sogjax track` is run on it without a pose, and its motions are held against the truth. Runs
are kept in `out` and not made again. The table is printed, and written as table.md.
"""

import json
import os
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from sogjax.errors import InputError
from sogjax.io.background_cache import VARIABLE
from sogjax.io.cache_folder import OFF
from sogjax.io.files import write_file, write_json
from sogjax.io.ground_truth import GroundTruth, load_ground_truth
from sogjax.io.motion import Motion, load_motion
from sogjax.io.recording_files import BACKGROUND, CALIBRATION, EXAMPLE_POSES, GROUND_TRUTH, SETTINGS, VIDEOS
from sogjax.quality.markers import joint_errors
from sogjax.run.run_files import METRICS
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
)
GIVEN = {
    "plates": (SETTINGS, BACKGROUND, EXAMPLE_POSES),
    "poses": (SETTINGS, EXAMPLE_POSES),
    "videos": (),
}
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
    lines = [machine_line(), "", "| recording | joints, mm | verdict |", "|---|---|---|"]
    for row in settings.rows:
        name = f"{row} {settings.frames}".replace(" ", "_").replace("=", "-")
        folder = Path(settings.out) / name
        found = _kept(folder) or _run(row, settings.frames, folder)
        lines.append(f"| {row} | {', '.join(f'{1e3 * mean:.0f}' for mean in found['joints'])} | {found['said']} |")
        print(lines[-1], flush=True)
    text = "\n".join(lines) + "\n"
    write_file(Path(settings.out) / "table.md", text)
    print(f"\n{text}")


def _kept(folder: Path) -> dict | None:
    path = folder / "found.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else None


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
        found = {"joints": [], "said": f"refused: {said.removeprefix('sogjax: ')}"}
    else:
        found = {"joints": _errors(results, GROUND_TRUTH.of(rendered)), "said": _verdicts(results)}
    write_json(folder / "found.json", found)
    return found


def _errors(results: Path, truth: Path) -> list[float]:
    """The mean error of the joints of each motion (metres), each held against the person that it suits best."""
    motions = [load_motion(path) for path in sorted(results.glob("motion*.npz"))]
    known = load_ground_truth(truth)
    people = [known.subject(name) for name in known.subjects] if known.subjects else [known]
    errors = np.array([[_mean(motion, person) for person in people] for motion in motions])
    rows, columns = linear_sum_assignment(errors)
    return errors[rows, columns].tolist()


def _mean(motion: Motion, person: GroundTruth) -> float:
    errors = joint_errors(motion, person)
    return float("inf") if errors is None else float(errors.errors.mean())


def _verdicts(results: Path) -> str:
    content = json.loads((results / METRICS.name).read_text(encoding="utf-8"))
    return "; ".join(dict.fromkeys(verdict["sentence"] for verdict in content["verdicts"].values()))


if __name__ == "__main__":
    run_script(main)
