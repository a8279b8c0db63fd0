"""How many frames per second are tracked, by stage?

python benchmarks/track_speed.py [recording=FOLDER] [frames=60] [overrides=[solver=lbfgs,...]]

Without a recording the demo's is used, rendered now if it is not there yet. The first frame, which compiles, is
left out of every rate. What is waited for are pictures that threads decode ahead.
"""

import time
from dataclasses import dataclass, field
from pathlib import Path

from sogjax.cli.schemas import DemoConfig
from sogjax.io.recording import open_recording
from sogjax.io.video import read_frames
from sogjax.run.result import row_numbers
from sogjax.run.terminal import progress
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.tracked import track_folder
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recording: str | None = None
    frames: int = 60
    overrides: list[str] = field(default_factory=list)


def main() -> None:
    """Print the table."""
    settings = settings_from(Settings)
    folder = demo_recording() if settings.recording is None else Path(settings.recording)
    recording = open_recording(folder)
    frames = min(settings.frames, recording.num_frames)
    result = track_folder(folder, [*settings.overrides, f"stop={frames}"])
    numbers = row_numbers(result)
    width, height = recording.rig.image_size(recording.rig.names[0])
    print(machine_line())
    print(f"{recording.name}: {len(recording.rig.names)} cameras, {width}x{height}, {frames} frames")
    print(f"{result.image_blobs:.0f} image blobs used per camera; {numbers['iterations']:.1f} iterations per frame")
    print(f"markers {numbers['mean mm']:.1f} mm, std {numbers['std mm']:.1f} mm, {numbers['lost']:.0f} lost\n")
    print(result.times.table())
    print(f"{'decoding alone':<32}{decoding_rate(folder, frames):10.1f} frames/s")


def demo_recording() -> Path:
    """The recording that `sogjax demo` tracks."""
    demo = DemoConfig()
    settings = SynthSettings(
        demo.motion, cameras=demo.cameras, frames=demo.frames, width=demo.width, height=demo.height, seed=demo.seed
    )
    return cached_recording(settings, progress=progress)


def decoding_rate(folder: Path, frames: int) -> float:
    """Multi-view frames per second when nothing else is done, without opening the files."""
    images = read_frames(open_recording(folder), 0, frames)
    next(images)
    begin = time.perf_counter()
    count = sum(1 for _ in images)
    return count / (time.perf_counter() - begin) if count else float("nan")


if __name__ == "__main__":
    run_script(main)
