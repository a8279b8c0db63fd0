"""Has a calculation become slower? Told in about a minute, beside other work as well.

    python benchmarks/small.py [renew=true]

Each calculation takes turns with the reference workload, in one thread, and the least CPU time of each counts: what
else the machine does changes both alike, if at all. Where a ratio of the two is more than 20 % above that in
`small.json`, it is measured again; where it stays, that is said, and the exit status is 1. `renew` writes the file
anew, as is due after a change that is meant. On another kind of processor than the file's the ratios are printed, and
nothing fails. Machines with processors of one kind differ as well, by 20 % where memory decides: an earlier commit on
the same machine tells whether the code became slower.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import equinox as eqx
import jax
from energies import frame_energy, human, quadratic, with_near_pairs
from gradient import Settings as Sizes
from gradient import scattered_views
from quantities import reference_workload
from runs import Scene, first_step

from sogjax.io.files import write_file
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.synth.cache import cached_recording
from sogjax.synth.picture import Shadows, plate_of, shot_of
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import stage_of
from sogjax.tracking.frame import FrameInput

Work = Callable[[], Any]

BASELINE = Path(__file__).with_name("small.json")
ALLOWED = 1.2
"""Times of its ratio in the baseline that a calculation may take."""
TURNS, SLICE = 24, 0.02
"""How often a calculation and the reference take turns, and the seconds that each works then, at least."""
RECORDING = SynthSettings(cameras=4, width=324, height=244, frames=4)


@dataclass
class Settings:
    """What is done, as `key=value` on the command line."""

    renew: bool = False


def main() -> None:
    """Measure, and compare or write."""
    settings = settings_from(Settings)
    print(machine_line(), flush=True)
    works, reference = calculations(), reference_workload()
    known = json.loads(BASELINE.read_text(encoding="utf-8")) if BASELINE.is_file() else {}
    if settings.renew:
        ratios = {name: median(ratio(work, reference) for _ in range(3)) for name, work in works.items()}
        known[processor()] = {"machine": machine_line(), "ratios": ratios}
        write_file(BASELINE, json.dumps(known, indent=1) + "\n")
        return
    if (before := known.get(processor())) is not None:
        sys.exit(compare(works, reference, before["ratios"]))
    for name, work in works.items():
        print(f"{name:<34}{ratio(work, reference):8.3f} of the reference", flush=True)
    print(f"{BASELINE.name} has {', '.join(known)}, this is {processor()}: nothing is concluded")


def processor() -> str:
    """Maker, family and model of the processor: ratios of others differ."""
    path = Path("/proc/cpuinfo")
    text = path.read_text(encoding="utf-8") if path.is_file() else ""
    found = dict(line.split(":", 1) for line in text.splitlines() if ":" in line)
    named = {key.strip(): value.strip() for key, value in found.items()}
    return " ".join(named.get(key, "unknown") for key in ("vendor_id", "cpu family", "model"))


def calculations() -> dict[str, Work]:
    """What is measured, each as a call without arguments."""
    body = human()
    energy = with_near_pairs(frame_energy(body, scattered_views(body, Sizes())))
    evaluated, rest = eqx.filter_jit(quadratic), body.poses["rest"]
    tracker, state, cells, capacities = first_step(Scene.of(cached_recording(RECORDING), RECORDING.frames))
    step = eqx.filter_jit(lambda tracker, state, cells: tracker.step(state, FrameInput(cells), capacities))
    views = eqx.filter_jit(lambda tracker, state, cells: tracker.views(FrameInput(cells), state, capacities)[0])
    return {
        "energy, gradient and curvature": lambda: evaluated(energy, rest),
        "what cameras see": lambda: views(tracker, state, cells),
        "step": lambda: step(tracker, state, cells),
        "rendered picture": rendering(),
    }


def rendering() -> Work:
    """A picture of the recording."""
    stage = stage_of(RECORDING)
    view, plate = stage.views[0], plate_of(stage.scene, stage.views[0])
    meshes = [person.posed(pose) for person, pose in zip(stage.people, stage.poses(0), strict=True)]
    return lambda: shot_of(view, plate, stage.people, meshes, Shadows.of(meshes))


def compare(works: dict[str, Work], reference: Work, before: dict[str, float]) -> int:
    """Print every ratio; 1 where one is above what is allowed twice."""
    slower = []
    for name, work in works.items():
        found = ratio(work, reference)
        if found > ALLOWED * before[name]:
            found = min(found, ratio(work, reference))
        change = found / before[name]
        print(f"{name:<34}{found:8.3f} of the reference, was {before[name]:.3f}: {change:.2f}", flush=True)
        if found > ALLOWED * before[name]:
            slower.append(name)
    if slower:
        print(f"slower by more than {ALLOWED - 1:.0%}: {'; '.join(slower)}")
    return 1 if slower else 0


def ratio(work: Work, reference: Work) -> float:
    """CPU time of some work in that of the reference, the least of each, in turns."""
    calls = [(each, _calls(each)) for each in (work, reference)]
    taken = [[_seconds(each, count) / count for each, count in calls] for _ in range(TURNS)]
    least, least_reference = map(min, zip(*taken, strict=True))
    return least / least_reference


def _calls(work: Work) -> int:
    """How many calls fill a slice."""
    _seconds(work, 1)  # compiles
    return max(1, round(SLICE / max(_seconds(work, 1), 1e-6)))


def _seconds(work: Work, calls: int) -> float:
    """CPU time of some calls."""
    begin = time.process_time()
    for _ in range(calls):
        jax.block_until_ready(work())
    return time.process_time() - begin


def use_one_core() -> None:
    """Let jax, which starts as many threads as there are cores, start one."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


if __name__ == "__main__":
    use_one_core()
    run_script(main)
