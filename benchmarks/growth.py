"""How do time and memory grow with what is tracked? A line each, and a plot.

    python benchmarks/growth.py out=docs/growth.png [parts=[step,run,sweep]]

The step is measured on rendered people, with 12 cameras of 648x486, one actor and all of its blobs where nothing else
is said; its memory is what its compiled program asks for. A run has four cameras, a sweep the demo's twelve; both are
processes of their own. An exponent of 1 is linear growth, of less growth beside a part that is always there.
"""

import io
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import equinox as eqx
import numpy as np
import yaml
from energies import with_blobs
from memory import Settings as Long
from memory import taken
from quantities import exponent, milliseconds
from runs import Scene, first_step

from sogjax.cli.words import quoted_value
from sogjax.io.actor_file import save_body
from sogjax.io.files import write_file
from sogjax.io.recording_files import INITIAL_POSE
from sogjax.model.body import Body
from sogjax.run.clock import TOTAL
from sogjax.run.recordings import opened
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings
from sogjax.tracking.frame import FrameInput

MIB = 2.0**20
FRAMES, MEMBERS = (1000, 3000, 10_000), 12
FEW = 20
"""Frames of the rendered recordings."""
PEOPLE = SynthSettings(motion="pass", actors=4, frames=FEW)


@dataclass
class Settings:
    """What is measured, as `key=value` on the command line."""

    out: str = "???"
    parts: list[str] = field(default_factory=lambda: ["step", "run", "sweep"])


class Growth(NamedTuple):
    """Seconds and mebibytes by a size."""

    of: str
    size: str
    sizes: Sequence[float]
    seconds: Sequence[float]
    mebibytes: Sequence[float] = ()


def main() -> None:
    """Print, and draw."""
    settings = settings_from(Settings)
    measured: dict[str, Callable[[Scene], Iterator[Growth]]] = {"step": of_step, "run": of_run, "sweep": of_sweep}
    print(machine_line(), flush=True)
    scene, grown = Scene.of(cached_recording(PEOPLE), FEW), []
    for part in settings.parts:
        for growth in measured[part](scene):
            grown.append(growth)
            print(line(growth), flush=True)
    write_file(Path(settings.out), drawn(grown))


def line(growth: Growth) -> str:
    """What was measured, and the exponents."""
    sizes = " / ".join(f"{size:g}" for size in growth.sizes)
    text = f"{growth.of} by {growth.size}, {sizes}: " + " / ".join(f"{value:.3g}" for value in growth.seconds)
    text += f" s (exponent {exponent(growth.sizes, growth.seconds):.2f})"
    if not growth.mebibytes:
        return text
    text += ", " + " / ".join(f"{value:.0f}" for value in growth.mebibytes)
    return f"{text} MiB ({exponent(growth.sizes, growth.mebibytes):.2f})"


def of_step(people: Scene) -> Iterator[Growth]:
    """Time and memory of a step."""
    one = replace(people, bodies=people.bodies[:1])
    names = one.recording.rig.names
    cameras = lambda count: replace(one, recording=opened(str(one.folder), list(names[:: len(names) // count])))
    blobs = lambda count: replace(one, bodies=[with_blobs(one.bodies[0], count)])
    actors = lambda count: replace(people, bodies=people.bodies[:count])
    pictures = lambda width: replace(one, recording=opened(str(larger(width))), frames=2)
    most = one.bodies[0].num_blobs
    alternatives: tuple[tuple[str, Sequence[int], Callable[[int], Scene]], ...] = (
        ("cameras", (3, 6, 12), cameras),
        ("blobs of the body", (most // 4, most // 2, most), blobs),
        ("actors", (1, 2, 4), actors),
        ("width of the pictures", (324, 648, 1296), pictures),
    )
    for size, sizes, scene_of in alternatives:
        seconds, mebibytes = zip(*(step(scene_of(each)) for each in sizes), strict=True)
        yield Growth("step", size, sizes, seconds, mebibytes)


def larger(width: int) -> Path:
    """The recording of the people with pictures of another size."""
    return cached_recording(replace(PEOPLE, width=width, height=2 * round(0.375 * width), frames=2))


def step(scene: Scene) -> tuple[float, float]:
    """Seconds and mebibytes of a step from the pose of a scene's first frame, which has the usual few iterations."""
    with TemporaryDirectory() as folder:
        tracker, state, cells, capacities = first_step(
            scene, f"initial_pose={quoted_value(str(pose_of(scene, Path(folder))))}"
        )
    work = eqx.filter_jit(lambda tracker, state, cells: tracker.step(state, FrameInput(cells), capacities))
    lowered = work.lower(tracker, state, cells)  # pyright: ignore[reportFunctionMemberAccess]
    needed = lowered.compile().compiled.memory_analysis()
    size = needed.temp_size_in_bytes + needed.argument_size_in_bytes + needed.output_size_in_bytes
    state = work(tracker, state, cells)[0]
    return milliseconds(work, tracker, state, cells) / 1000.0, size / MIB


def pose_of(scene: Scene, folder: Path) -> Path:
    """A file with the rough poses of the actors that are tracked alone."""
    poses = yaml.safe_load(INITIAL_POSE.of(scene.folder).read_text(encoding="utf-8"))
    names = [body.name for body in scene.bodies]
    path = folder / INITIAL_POSE.name
    path.write_text(yaml.safe_dump(poses[names[0]] if len(names) == 1 else {name: poses[name] for name in names}))
    return path


def of_run(people: Scene) -> Iterator[Growth]:
    """Time and memory of a run."""
    one = SynthSettings(cameras=4, frames=FEW)
    folder = cached_recording(one)
    with actor_file(Scene.of(folder, FEW).bodies[0]) as actor:
        settings = Long(str(folder), actor, frames=FEW)
        both = [taken(settings, frames // FEW) for frames in FRAMES]
    yield Growth("run of 4 cameras", "frames", FRAMES, *zip(*both, strict=True))


def of_sweep(people: Scene) -> Iterator[Growth]:
    """Time of a sweep: members one after the other in a process."""
    folder = cached_recording(SynthSettings())
    with actor_file(Scene.of(folder, FEW).bodies[0]) as actor, TemporaryDirectory() as out:
        values = ",".join(f"{value:.2f}" for value in np.linspace(0.5, 2.0, MEMBERS))
        words = [f"recording={folder}", f"actor={actor}", f"stop={FEW}", "-m", f"energy.limit_weight={values}"]
        command = [sys.executable, "-m", "sogjax", "track", *words, f"hydra.sweep.dir={out}/sweep"]
        subprocess.run(command, check=True, capture_output=True, cwd=out, env=os.environ)
        notes = [json.loads((Path(out) / f"sweep/{k}/run.json").read_text())["seconds"] for k in range(MEMBERS)]
    seconds = np.cumsum([note[TOTAL] for note in notes]).tolist()
    yield Growth("sweep", "members", range(1, MEMBERS + 1), seconds)


class actor_file(TemporaryDirectory):  # noqa: N801 - used as a function
    """A file of a body, for a while."""

    def __init__(self, body: Body):
        super().__init__()
        self._body = body

    def __enter__(self) -> str:
        path = Path(super().__enter__()) / "actor.yaml"
        save_body(path, self._body)
        return str(path)


def drawn(grown: Sequence[Growth]) -> bytes:
    """A panel for each; seconds to the left, mebibytes to the right."""
    from matplotlib.figure import Figure

    rows = -(-len(grown) // 3)
    figure = Figure((9.0, 2.4 * rows), layout="constrained", dpi=80)
    for axes, growth in zip(np.ravel(figure.subplots(rows, 3, squeeze=False)), grown, strict=False):
        axes.plot(growth.sizes, growth.seconds, "o-", color="C0", markersize=3)
        axes.set(title=growth.of, xlabel=growth.size, xlim=(0, 1.1 * max(growth.sizes)))
        axes.set_ylim(0, 1.1 * max(growth.seconds))
        axes.set_ylabel("s", color="C0")
        if growth.mebibytes:
            right = axes.twinx()
            right.plot(growth.sizes, growth.mebibytes, "s--", color="C1", markersize=3)
            right.set_ylim(0, 1.2 * max(growth.mebibytes))
            right.set_ylabel("MiB", color="C1")
    stream = io.BytesIO()
    figure.savefig(stream)
    return stream.getvalue()


if __name__ == "__main__":
    run_script(main)
