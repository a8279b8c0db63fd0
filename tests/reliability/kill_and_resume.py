"""Does a run that is killed at any moment go on to the very end that it would have had?

python tests/reliability/kill_and_resume.py kills=20

tracks a small rendered walk, all outputs on, initial pose searched for; kills the process (SIGKILL) at random moments
of its life in its folder, every other time after it wrote its first frames; goes on with resume=true, and compares
every array of the end with a run that was left alone.
"""

import random
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, fields
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from sogjax.errors import InputError
from sogjax.io.actor_file import named_body
from sogjax.io.frame_motions import FRAMES, PARTIAL
from sogjax.io.frame_table import read_frames_log
from sogjax.io.motion import Motion, load_motion
from sogjax.io.source import look_at_source
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings

LATE = 0.2
"""Part of a run's life in which it is killed after it wrote frames."""


@dataclass
class Settings:
    """Of the runs and the kills."""

    kills: int = 20
    seed: int = 0
    frames: int = 40
    cameras: int = 3
    overlay: bool = True
    made: bool = False
    """Make the actor from example poses, too."""


@dataclass(frozen=True)
class Undisturbed:
    """A run that was left alone, with which others are compared."""

    command: list[str]
    """Without its folder."""
    motion: Motion
    seconds: float
    """That it took when its programs had been compiled."""


@dataclass(frozen=True)
class Kills:
    """What many kills did."""

    left: list[int]
    """Frames that could be read after each."""
    runs: int
    """Folders that were needed, as some runs came to their end before they were killed."""


def main() -> None:
    """Kill, go on, compare, and say how many frames every kill left."""
    settings = settings_from(Settings)
    print(machine_line())
    with TemporaryDirectory() as place:
        kills = killed_and_resumed(settings, undisturbed(settings, Path(place)), Path(place))
    print(
        f"{len(kills.left)} kills in {kills.runs} runs of {settings.frames} frames: every end is bit for bit the same"
    )


def undisturbed(settings: Settings, place: Path) -> Undisturbed:
    """A run in a folder below `place`, done twice, the second time for the clock.

    Compiled programs are kept from the first one on, where SOGJAX_COMPILATION_CACHE is set.
    """
    command, folder = tracking(settings), place / "alone"
    started(command, folder).communicate()
    begin = time.perf_counter()
    started([*command, "overwrite=true"], folder).communicate()
    return Undisturbed(command, load_motion(folder / "motion.npz"), time.perf_counter() - begin)


def killed_and_resumed(settings: Settings, alone: Undisturbed, place: Path) -> Kills:
    """Kill runs in folders below `place` and go on with them, until there were enough kills.

    Raises:
        InputError: one came to another end.
    """
    chance, left, folder, runs = random.Random(settings.seed), [], place / "run_0", 1
    while len(left) < settings.kills:
        late = len(left) % 2 == 1
        after = chance.uniform(0.0, LATE * alone.seconds if late else alone.seconds)
        if killed(alone.command, folder, after, late):
            left.append(frames_left(folder))
            print(f"kill {len(left)}: {left[-1]} frames readable", flush=True)
            continue
        check_same(folder, alone.motion, settings)
        folder, runs = place / f"run_{runs}", runs + 1
    process = started([*alone.command, "resume=true"], folder)
    _, said = process.communicate()
    if process.returncode != 0:
        raise InputError(f"{folder}: the last run did not end well: {said}")
    check_same(folder, alone.motion, settings)
    return Kills(left, runs)


def tracking(settings: Settings) -> list[str]:
    """The command line of the runs, without its folder."""
    rendered = SynthSettings(
        cameras=settings.cameras, frames=settings.frames, width=160, height=120, example_poses=settings.made
    )
    command = ["track", f"recording={cached_recording(rendered)}", "initial_pose=auto", "images.depth=6"]
    command += [] if settings.made else [f"actor={named_body('human')}"]
    return [*command, *(f"outputs.{name}={str(settings.overlay).lower()}" for name in ("overlay", "rerun", "page"))]


def started(command: list[str], folder: Path) -> subprocess.Popen:
    """A run of its own process."""
    words = [sys.executable, "-m", "sogjax", *command, f"out={folder}"]
    return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)


def killed(command: list[str], folder: Path, after: float, late: bool) -> bool:
    """Go on in a folder and kill the process some seconds after it claimed it, or wrote frames; False: it ended."""
    before = frames_left(folder)
    process = started([*command, "resume=true"], folder)
    while process.poll() is None and not (frames_left(folder) > before if late else (folder / ".lock").exists()):
        time.sleep(0.02)
    try:
        _, said = process.communicate(timeout=after)
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGKILL)
        process.communicate()
        return True
    if process.returncode != 0:
        raise InputError(f"the run did not end well: {said}")
    return False


def frames_left(folder: Path) -> int:
    """How many frames can be read."""
    done = folder / "motion.npz"
    if done.is_file():
        return load_motion(done).num_frames
    try:
        found = read_frames_log(folder / PARTIAL / FRAMES)
    except InputError:
        return 0
    return 0 if found is None else len(found)


def check_same(folder: Path, whole: Motion, settings: Settings) -> None:
    """Compare a run that was gone on with.

    Raises:
        InputError: it has another end.
    """
    found = load_motion(folder / "motion.npz")
    for entry in fields(Motion):
        if not np.array_equal(getattr(found, entry.name), getattr(whole, entry.name)):
            raise InputError(f"{folder}: {entry.name} differs from that of a run left alone")
    if settings.overlay and look_at_source(folder / "overlay.mp4").num_frames != settings.frames:
        raise InputError(f"{folder}: overlay.mp4 does not have all frames")
    names = {path.name for path in folder.iterdir()}
    if not {"run.json", "config.yaml", "motion.bvh"} <= names or any(
        name.endswith((".partial", ".lock")) or ".tmp" in name for name in names
    ):
        raise InputError(f"{folder}: holds {', '.join(sorted(names))}")


if __name__ == "__main__":
    run_script(main)
