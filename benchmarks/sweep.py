"""What does a sweep of 15 settings in one compiled call cost, in units of one run?

python benchmarks/sweep.py [frames=24] [repeats=2] [actor=FILE] [overrides=[solver=lbfgs,energy.pairs=sparse]]

Tracks the rendered walk of the demo with three values of w_l and five of w_a. Everything is warm, and the least of
`repeats` times counts. Processor time stands beside wall-clock time, which suffers from whatever else the machine does.
Last column: the largest difference between a pose of the sweep and that of the same setting in a run of its own
(radians or metres), over four settings and all frames.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import product
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from sogjax.app import build
from sogjax.app.cells import cells_of, cells_of_clip
from sogjax.app.composition import composed
from sogjax.app.configs import ImagesConfig
from sogjax.app.job import Job
from sogjax.app.overrides import quoted_value
from sogjax.app.pipeline import Preparation
from sogjax.app.progress import progress
from sogjax.app.recordings import actors_of, opened
from sogjax.app.script import machine_line, run_script, settings_from
from sogjax.data.video import read_prepared
from sogjax.synth import SynthSettings, cached_recording
from sogjax.track.many import track_many
from sogjax.track.scan import track_clip
from sogjax.track.tracker import track

LIMIT_WEIGHTS = (0.3, 1.0, 3.0)
ACCELERATION_WEIGHTS = (0.003, 0.006, 0.01, 0.02, 0.04)
PAIRS = list(product(LIMIT_WEIGHTS, ACCELERATION_WEIGHTS))


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    frames: int = 24
    repeats: int = 2
    actor: str | None = None
    overrides: list[str] = field(default_factory=list)


def main() -> None:
    """Print the table."""
    settings = settings_from(Settings)
    words = [f"recording={quoted_value(str(cached_recording(SynthSettings(), progress=progress)))}"]
    words += [f"stop={settings.frames}", *settings.overrides]
    words += [] if settings.actor is None else [f"actor={quoted_value(settings.actor)}"]
    config = composed("track", words)
    recording = opened(config.recording)
    bodies, _ = actors_of(recording, config.actor, config.body, config.color)
    job = Job.from_config(recording, bodies, config)
    cells = cells_of_clip(recording, job.grids, ImagesConfig(depth=config.images.depth), job.frames)
    weights = [f"energy.limit_weight={a} energy.acceleration_weight={b}" for a, b in PAIRS]
    trackers = [build.varied(job.tracker, composed("track", [*words, *pair.split()])) for pair in weights]
    starts = jnp.stack([job.start] * len(trackers))

    def decoded() -> Iterator[Any]:
        return map(cells_of, read_prepared(recording, Preparation(job.grids), *job.frames))

    from_videos = lambda: [frame.result.pose for frame in track(job.tracker, job.start, decoded())]
    from_cells = lambda: [frame.result.pose for frame in track(job.tracker, job.start, cells)]
    one_call = lambda: track_clip(job.tracker, job.start, cells)[0].pose
    sweep = lambda: track_many(trackers, starts, cells)[0].pose
    own_boxes = lambda: track_many(trackers, starts, cells, common_boxes=False)[0].pose
    in_step = lambda: track_many(trackers, starts, cells, "in_step")[0].pose
    decoded_sweep = lambda: track_many(trackers, starts, np.stack(list(decoded())))[0].pose

    alone = {k: np.asarray(track_clip(trackers[k], job.start, cells)[0].pose) for k in range(0, len(trackers), 4)}
    units = [measured(from_videos, settings.repeats), measured(from_cells, settings.repeats)]
    print(machine_line())
    print(
        f"{settings.frames} frames, {len(trackers)} settings; processor and wall-clock ms a frame, and these in units"
    )
    print(
        f"of one run from videos and from kept cells\n\n{'':<38}{'processor':>11}{'wall':>9}{'videos':>15}{'cells':>15}"
    )
    print(row("one run, from videos", units[0], units, settings.frames))
    print(row("one run, from kept cells", units[1], units, settings.frames))
    print(row("one run, one compiled call", measured(one_call, settings.repeats), units, settings.frames))
    for name, run in (
        ("sweep, from videos", decoded_sweep),
        ("sweep, from kept cells", sweep),
        ("  every member its own boxes", own_boxes),
        ("  solver in step", in_step),
    ):
        poses = np.asarray(run())
        difference = max(float(np.abs(poses[:, k] - pose).max()) for k, pose in alone.items())
        print(row(name, measured(run, settings.repeats), units, settings.frames) + f"  {difference:.0e}", flush=True)


def measured(run: Callable[[], Any], repeats: int) -> tuple[float, float]:
    """Processor and wall-clock seconds, the least of some times, after a call that compiles."""
    jax.block_until_ready(run())
    times = []
    for _ in range(repeats):
        begin = time.process_time(), time.perf_counter()
        jax.block_until_ready(run())
        times.append((time.process_time() - begin[0], time.perf_counter() - begin[1]))
    return min(cpu for cpu, _ in times), min(wall for _, wall in times)


def row(name: str, seconds: tuple[float, float], units: list[tuple[float, float]], frames: int) -> str:
    """One line of the table."""
    shares = "".join(f"{seconds[0] / unit[0]:>8.2f}{seconds[1] / unit[1]:>7.2f}" for unit in units)
    return f"{name:<38}{1e3 * seconds[0] / frames:>11.1f}{1e3 * seconds[1] / frames:>9.1f}{shares}"


if __name__ == "__main__":
    run_script(main)
