"""Does the memory of a run stay flat, however long the recording is?

python benchmarks/memory.py recording=FOLDER [actor=FILE] [frames=16] [repeats=[1,4]] [overrides=[...]]

Tracks videos (mp4v) that show the first frames of a recording forwards and backwards in turn, with all outputs
(overlay, Rerun file with pictures), each length in a process of its own, and prints its largest resident memory.
"""

import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from quantities import Quantity

from sogjax.io.recording import Recording
from sogjax.io.source import open_source
from sogjax.io.video import VideoWriter
from sogjax.run.actors import ActorRequest, make_actors
from sogjax.run.page import FRAMES_ON_PAGE
from sogjax.run.recordings import opened
from sogjax.run.run import Run
from sogjax.run.runner import run_passes
from sogjax.run.track import opened_clip
from sogjax.settings.compose import track_config
from sogjax.study.script import machine_line, run_script, settings_from

MIB = 1024
"""Kibibytes, in which the system counts."""
FLAT = 10.0
"""Mebibytes that 1000 frames may add: what allocators keep, not what a frame needs. The first thousand adds more."""


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recording: str = "???"
    actor: str | None = None
    frames: int = 16
    repeats: list[int] = field(default_factory=lambda: [1, 4])
    overrides: list[str] = field(default_factory=lambda: ["solver.max_iterations=20"])


def main() -> None:
    """Print the table; with one number in `repeats`, only the seconds and the memory of this process."""
    settings = settings_from(Settings)
    if len(settings.repeats) == 1:
        print(track_repeatedly(settings, settings.repeats[0]), most_resident_mib())
        return
    print(machine_line())
    for repeats in settings.repeats:
        words = [word for word in sys.argv[1:] if not word.startswith("repeats=")]
        command = [sys.executable, __file__, *words, f"repeats=[{repeats}]"]
        done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
        largest = float(done.stdout.split()[-1])
        print(f"{settings.frames * repeats:6d} frames: at most {largest:6.0f} MiB resident", flush=True)


def long_quantities(recording: Path, actor: Path, repeats: tuple[int, int] = (64, 192)) -> Iterator[Quantity]:
    """What a thousand more frames of four cameras take; nothing, if memory is flat."""
    settings = Settings(str(recording), str(actor))
    few, many = (taken(settings, each)[1] for each in repeats)
    thousands = settings.frames * (repeats[1] - repeats[0]) / 1000.0
    yield Quantity("memory", f"most resident, {settings.frames * repeats[1]} frames, four cameras", many, "MiB")
    yield Quantity("memory", "growth in 1000 frames", (many - few) / thousands, "MiB", target=FLAT)


def taken(settings: Settings, repeats: int) -> tuple[float, float]:
    """Seconds of a process of its own that tracks the frames so many times, and mebibytes it has resident at most."""
    cameras = ",".join(opened(settings.recording).rig.names[:4])
    words = [f"recording={settings.recording}", f"actor={settings.actor}", f"frames={settings.frames}"]
    words += [f"repeats=[{repeats}]", f"overrides=[solver.max_iterations=20,'cameras=[{cameras}]']"]
    done = subprocess.run([sys.executable, __file__, *words], check=True, stdout=subprocess.PIPE, text=True)
    seconds, most = done.stdout.split()[-2:]
    return float(seconds), float(most)


def track_repeatedly(settings: Settings, repeats: int) -> float:
    """The first frames of the recording forwards and backwards, so many times, into a folder that is removed; seconds.

    Making the videos is not counted.
    """
    config = track_config(settings.overrides, recording=settings.recording, actor=settings.actor)
    recording = opened(config.recording, config.cameras)
    config.outputs = config.outputs.asked()
    actors = make_actors(ActorRequest.of_track(opened_clip(recording, config), config))
    with TemporaryDirectory() as folder:
        longer = longer_recording(recording, settings.frames, repeats, Path(folder))
        begin = time.perf_counter()
        kept = Path(folder) / "kept"
        clip = opened_clip(longer, config).kept_in(kept, None).shown_small(kept, FRAMES_ON_PAGE)
        run = run_passes(Run(clip, config, Path(folder) / "out", kept, records={"actors": actors}))
        assert len(run.result.converged) == longer.num_frames
        return time.perf_counter() - begin


def most_resident_mib() -> float:
    """Of this process so far; Linux only.

    By `VmHWM`, which starts from zero with a program: `ru_maxrss` counts what the process was forked from.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return float(status.partition("VmHWM:")[2].split()[0]) / MIB


def longer_recording(recording: Recording, frames: int, repeats: int, folder: Path) -> Recording:
    """Videos that show the first frames forwards and backwards in turn, so that the poses stay trackable."""
    for camera in recording.rig.names:
        source = open_source(recording.sources[camera], recording.first_frame + recording.frame_offset[camera])
        images = [image for _ in range(frames) if (image := source.read()) is not None]
        source.close()
        with VideoWriter(folder / f"{camera}.mp4", recording.fps) as video:
            for k in range(repeats):
                for image in images[:: -1 if k % 2 else 1]:
                    video.write(image)
    return replace(
        recording,
        sources={camera: folder / f"{camera}.mp4" for camera in recording.rig.names},
        frame_offset=dict.fromkeys(recording.rig.names, 0),
        first_frame=0,
        num_frames=frames * repeats,
        num_images=dict.fromkeys(recording.rig.names, frames * repeats),
        picked={},
        missing={},
    )


if __name__ == "__main__":
    run_script(main)
