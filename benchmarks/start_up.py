"""How long does a person wait for the first motion, with programs compiled now and with those of an earlier run?

    python benchmarks/start_up.py [against=FOLDER] [commands=[given,searched,actor,demo]] [programs=true]

Each command is a process of its own, on the demo's recording with its actor: with an empty folder for compiled
programs, and again with what the first run kept. `against` is another checkout of sogjax, whose commands take turns
with this one's. CPU seconds are those of all processes, which other work beside changes little. With `programs`, what
a command of this checkout compiles is told as well, from a run of its own (`compiled_programs.py`).
"""

import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from compiled_programs import TABLE
from quantities import Quantity
from track_speed import demo_recording

from sogjax.run.compilation_cache import COMPILER_VARIABLE
from sogjax.study.script import machine_line, run_script, settings_from

OURS, PROGRAMS = Path(__file__).resolve().parents[1], Path(__file__).with_name("compiled_programs.py")
SOGJAX = ("-m", "sogjax")
FRAMES = "stop=3"
NAMES = {
    "given": f"track {FRAMES}, given pose",
    "searched": f"track {FRAMES}, searched pose",
    "actor": "actor of four example poses",
    "demo": "demo, rendering included",
}
AIMS = {"given": (15.0, 6.0), "searched": (28.0, 14.0), "actor": (30.0, 15.0), "demo": (75.0, None)}
"""Seconds with programs compiled now, and kept."""


@dataclass
class Settings:
    """What is measured, as `key=value` on the command line."""

    against: str | None = None
    commands: list[str] = field(default_factory=lambda: [*NAMES])
    programs: bool = False


def main() -> None:
    """Print seconds, one row for each command."""
    settings, recording = settings_from(Settings), demo_recording()
    checkouts = [OURS] if settings.against is None else [Path(settings.against).resolve(), OURS]
    print(machine_line())
    heads = ["cold", "kept"] if len(checkouts) == 1 else ["cold before", "now", "ratio", "kept before", "now", "ratio"]
    print(f"{'seconds':<34}" + "".join(f"{head:>12}" for head in heads), flush=True)
    with TemporaryDirectory() as folder:
        actor = made_actor(recording, Path(folder), checkouts[0])  # the older one does not read all that is new
        for name in settings.commands:
            taken = [seconds(name, checkout, recording, actor) for checkout in checkouts]
            for row, kind in enumerate((NAMES[name], "    CPU seconds")):
                columns = []
                for times in zip(*(of_checkout[row] for of_checkout in taken), strict=True):
                    columns += [*times] if len(times) == 1 else [*times, times[1] / times[0]]
                print(f"{kind:<34}" + "".join(f"{value:>12.2f}" for value in columns), flush=True)
            if settings.programs:
                print(compiled_programs(name, recording, actor), flush=True)


def start_up_quantities(actor: Path) -> Iterator[Quantity]:
    """All of them, as rows of the report."""
    recording = demo_recording()
    for name, aims in AIMS.items():
        for kept, value, aim in zip(("cold", "kept"), seconds(name, OURS, recording, actor)[0], aims, strict=True):
            yield Quantity("start-up", f"{NAMES[name]}, {kept}", value, "s", target=aim)


def made_actor(recording: Path, folder: Path, checkout: Path) -> Path:
    """The actor that a checkout makes of a recording."""
    with TemporaryDirectory() as programs:
        _run(["actor", f"recording={recording}", f"out={folder / 'actor.yaml'}"], checkout, Path(programs), folder)
    return folder / "actor.yaml"


def seconds(name: str, checkout: Path, recording: Path, actor: Path) -> tuple[list[float], list[float]]:
    """Of a command of a checkout, by the clock and of CPUs: with an empty folder for compiled programs, then again."""
    with TemporaryDirectory() as folder:
        programs, by_clock, of_cpus = Path(folder) / "programs", [], []
        for turn in ("cold", "kept"):
            out = Path(folder) / turn
            out.mkdir()
            begin, cpus = time.perf_counter(), cpu_seconds()
            _run(words_of(name, recording, actor, out), checkout, programs, out)
            by_clock.append(time.perf_counter() - begin)
            of_cpus.append(cpu_seconds() - cpus)
    return by_clock, of_cpus


def cpu_seconds() -> float:
    """Those of all processes that were started and have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def words_of(name: str, recording: Path, actor: Path, out: Path) -> list[str]:
    """A command, as words."""
    track = ["track", f"recording={recording}", f"actor={actor}", FRAMES, f"out={out / 'run'}"]
    return {
        "given": track,
        "searched": [*track, "initial_pose=auto"],
        "actor": ["actor", f"recording={recording}", f"out={out / 'actor.yaml'}"],
        "demo": ["demo", f"out={out / 'demo'}"],
    }[name]


def compiled_programs(name: str, recording: Path, actor: Path) -> str:
    """The table of what a command of this checkout compiles, with an empty folder for compiled programs."""
    with TemporaryDirectory() as folder:
        out = Path(folder)
        printed = _run(words_of(name, recording, actor, out), OURS, out / "programs", out, [str(PROGRAMS)])
    return printed[printed.index(TABLE) :]


def _run(command: list[str], checkout: Path, programs: Path, cache: Path, start: Sequence[str] = SOGJAX) -> str:
    """Run a command of a checkout; what it printed."""
    environment = {key: value for key, value in os.environ.items() if key != COMPILER_VARIABLE}  # each has its own
    environment |= {
        "PYTHONPATH": str(checkout),
        "SOGJAX_COMPILATION_CACHE": str(programs),
        "SOGJAX_CACHE": str(cache),
    }
    line = [sys.executable, *start, *command]  # not in a checkout's folder, whose modules would go first
    done = subprocess.run(line, capture_output=True, text=True, env=environment, cwd=cache)
    if done.returncode:
        raise RuntimeError(f"{checkout}: sogjax {' '.join(command)} ended with {done.returncode}:\n{done.stderr}")
    return done.stdout


if __name__ == "__main__":
    run_script(main)
