"""How late does a pose come after its pictures, by number of cameras and their size?

python benchmarks/live_latency.py recording=FOLDER actor=FILE [cameras=[2,4]] [scales=[1.0,0.5]] [seconds=30]
    [offline=motion.npz] ["faults={drop: 0.05, delay: {1: 0.08}, gone: {13: [10, 12]}, seed: 1}"]

The recording is replayed at its own rate, with the first cameras of it and with pictures made smaller. It prints the
table of docs/performance.md. Two cores of a larger machine: taskset -c 0,1 python ... With `offline`, a motion of the
same recording and actor (`sogjax track tracking.both_ways=false outputs.filter=null`), each row says how far the joints
are from it, and in how many frames an arm or leg is where the other one is there.
"""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import cv2
import jax.numpy as jnp
import numpy as np

from sogjax.io.calibration.load import save_calibration
from sogjax.io.files import write_file
from sogjax.io.image_file import read_image, write_image
from sogjax.io.motion import Motion, load_motion
from sogjax.io.recording import Recording
from sogjax.io.recording_files import BACKGROUND, CALIBRATION, SETTINGS, VIDEOS
from sogjax.io.video import VideoWriter, read_frames
from sogjax.realtime.start import actors_of, session_of
from sogjax.realtime.state import LiveState
from sogjax.run.recordings import opened
from sogjax.settings.compose import composed_config
from sogjax.settings.live import LiveConfig
from sogjax.settings.option import REQUIRED
from sogjax.study.script import machine_line, run_script, settings_from


@dataclass
class Settings:
    """What is replayed, as `key=value` on the command line."""

    recording: str = REQUIRED
    actor: str = REQUIRED
    cameras: list[int] = field(default_factory=lambda: [2, 4])
    scales: list[float] = field(default_factory=lambda: [1.0, 0.5])
    seconds: float = 30.0
    loop: bool = True
    offline: str | None = None
    """A motion to compare the joints with."""
    faults: dict[str, Any] = field(default_factory=dict)
    """What goes wrong with the cameras, as the settings of `sogjax live` have it."""


def main() -> None:
    """Print the table."""
    settings = settings_from(Settings)
    whole = opened(settings.recording)
    print(machine_line())
    print(f"load before: {os.getloadavg()[0]:.1f}\n")
    columns = "| cameras | pictures | rate | poses/s | p50 ms | p95 ms | p99 ms | most ms | overwritten |"
    if settings.offline:
        columns += " mm from offline, mean | within 5 mm | 95 % within mm | exchanged limbs, frames |"
    print(columns)
    print("|---" * (columns.count("|") - 1) + "|")
    for scale in settings.scales:
        with scaled(whole, scale) as recording:
            for count in settings.cameras:
                print(row(recording, count, settings), flush=True)
    print(f"\nload after: {os.getloadavg()[0]:.1f}")


def row(recording: Recording, count: int, settings: Settings) -> str:
    """A row of the table: the recording with the first cameras."""
    names = recording.rig.names[:count]
    chosen: dict[str, Any] = {"recording": recording.path, "actor": settings.actor, "replay": True}
    chosen |= {"cameras": [*names], "seconds": settings.seconds, "loop": settings.loop, "faults": settings.faults}
    config: LiveConfig = composed_config(LiveConfig, "live", chosen.items())
    fewer = replace(recording, rig=recording.rig.select(names))
    session = session_of(fewer, actors_of(config), config, None)
    states = [*session.states()]
    told = session.report()
    latency, (width, height) = told["latency_ms"], fewer.rig.image_size(names[0])
    share = told["lost"]["overwritten_sets"] / max(told["sets"], 1)
    times = " | ".join(f"{latency[key]:.0f}" for key in ("p50", "p95", "p99", "max"))
    cells = (f"{count}", f"{width}x{height}", f"{recording.fps:.0f}", f"{told['poses_per_second']:.1f}", times)
    compared = (
        f" {beside(states, load_motion(Path(settings.offline)), len(recording.frames))} |" if settings.offline else ""
    )
    return f"| {' | '.join(cells)} | {share:.0%} |{compared}"


def beside(states: Sequence[LiveState], offline: Motion, num_frames: int) -> str:
    """How far the joints of the first actor are from those of another motion, as cells of the table."""
    rows = {int(frame): row for row, frame in enumerate(offline.frame)}
    pairs = [(rows.get(state.frame % num_frames), state) for state in states if state.tracked]
    found = [(row, state.actors[0].world_from_joint[:, :3, 3]) for row, state in pairs if row is not None]
    if not found:
        return "| | |"
    known = offline.world_from_joint[[row for row, _ in found], :, :3, 3]
    live = np.stack([joints for _, joints in found])
    away = 1e3 * np.linalg.norm(live - known, axis=-1)
    names = offline.joint_names.tolist()
    exchanged = np.zeros(len(found), bool)
    for end in ("wrist", "ankle"):
        sides = [[k for k, name in enumerate(names) if name.startswith(f"{side}_{end}")] for side in ("left", "right")]
        if all(sides):
            left, right = (of_side[-1] for of_side in sides)
            apart = np.linalg.norm(known[:, left] - known[:, right], axis=-1)
            as_is = np.linalg.norm(live[:, [left, right]] - known[:, [left, right]], axis=-1).sum(axis=1)
            otherwise = np.linalg.norm(live[:, [right, left]] - known[:, [left, right]], axis=-1).sum(axis=1)
            exchanged |= (otherwise < as_is) & (as_is > apart)
    within = np.mean(away <= 5.0)
    return f"{away.mean():.1f} | {within:.0%} | {np.percentile(away, 95):.0f} | {int(exchanged.sum())}"


@contextmanager
def scaled(recording: Recording, scale: float) -> Iterator[Recording]:
    """The recording with smaller pictures, in a folder of its own."""
    if scale == 1.0:
        yield recording
        return
    with tempfile.TemporaryDirectory() as name:
        folder, names = Path(name), recording.rig.names
        sizes = {name: _even(recording.rig.image_size(name), scale) for name in names}
        small = lambda name, picture: cv2.resize(picture, sizes[name], interpolation=cv2.INTER_AREA)
        with ExitStack() as stack:
            videos = {name: VideoWriter(VIDEOS.of(folder) / f"{name}.mp4", recording.fps) for name in names}
            writers = {name: stack.enter_context(video) for name, video in videos.items()}
            for pictures in read_frames(recording):
                for name, picture in zip(names, pictures, strict=True):
                    writers[name].write(small(name, picture))
        for name, path in recording.background.items():
            write_image(BACKGROUND.of(folder) / f"{name}.png", small(name, read_image(path)))
        ratio = np.array([[sizes[name][0] / recording.rig.image_size(name)[0]] for name in names])
        known = recording.rig.cameras
        cameras = replace(
            known,
            intrinsics=_scaled_intrinsics(np.asarray(known.intrinsics), ratio),
            image_size=jnp.asarray([sizes[name] for name in names], jnp.float32),
        )
        save_calibration(CALIBRATION.of(folder), replace(recording.rig, cameras=cameras))
        write_file(SETTINGS.of(folder), f"up: {recording.up}\nfps: {recording.fps}\n")
        yield opened(str(folder))


def _even(size: tuple[int, int], scale: float) -> tuple[int, int]:
    """A size that codecs store."""
    return 2 * round(0.5 * scale * size[0]), 2 * round(0.5 * scale * size[1])


def _scaled_intrinsics(intrinsics: np.ndarray, ratio: np.ndarray):
    """Pixels have their origin in the middle of the first one."""
    found = intrinsics.copy()
    found[:, :2, :2] *= ratio[:, :, None]
    found[:, :2, 2] = (intrinsics[:, :2, 2] + 0.5) * ratio - 0.5
    return jnp.asarray(found, jnp.float32)


if __name__ == "__main__":
    run_script(main)
