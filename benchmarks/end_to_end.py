"""How near is tracking, from the videos to the poses, to decoding alone?

python benchmarks/end_to_end.py [recording=FOLDER] [actor=FILE] [frames=60] [repeats=3] [settings=["solver=lbfgs",...]]

Each of `settings` is a list of overrides of `sogjax track`, separated by spaces. Decoding alone and tracking take turns
in one process, after a run that compiles; the fastest of the repeats counts, without the first frame of each run.
Nothing is written. Without a recording the demo's is used, rendered now if it is not there yet.
"""

import time
from dataclasses import dataclass, field
from pathlib import Path

from track_speed import demo_recording

from sogjax.cli.words import quoted_value
from sogjax.io.recording import Recording, open_recording
from sogjax.io.threads import prefetch
from sogjax.io.video import read_prepared
from sogjax.run.clip import FRAMES_AHEAD
from sogjax.run.result import row_numbers
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.tracked import track_folder

HEAD = f"{'settings':<48}{'decoding alone':>16}{'to pose':>10}{'ratio':>8}{'step':>8}{'mean mm':>10}{'lost':>6}"


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recording: str | None = None
    actor: str | None = None
    frames: int = 60
    repeats: int = 3
    settings: list[str] = field(default_factory=lambda: ["", "solver=gauss_newton energy.pairs=sparse"])


def main() -> None:
    """Print one row for each of the settings."""
    settings = settings_from(Settings)
    folder = demo_recording() if settings.recording is None else Path(settings.recording)
    recording = open_recording(folder)
    frames = min(settings.frames, recording.num_frames)
    actor = [f"actor={quoted_value(settings.actor)}"] if settings.actor else []
    print(machine_line())
    width, height = recording.rig.image_size(recording.rig.names[0])
    print(f"{recording.name}: {len(recording.rig.names)} cameras, {width}x{height}, {frames} frames; frames/s\n")
    print(HEAD, flush=True)
    for words in settings.settings:
        overrides = [*actor, f"stop={frames}", *words.split()]
        result = track_folder(folder, overrides)
        decoding, whole, step = [], [], []
        for _ in range(settings.repeats):
            decoding.append(decoding_rate(recording, frames))
            result = track_folder(folder, overrides)
            whole.append(result.times.frames_per_second("whole"))
            step.append(result.times.frames_per_second("step"))
        numbers = row_numbers(result)
        print(
            f"{words or 'defaults':<48}{max(decoding):>16.1f}{max(whole):>10.1f}{max(whole) / max(decoding):>8.2f}"
            f"{max(step):>8.1f}{numbers['mean mm']:>10.1f}{numbers['lost']:>6.0f}",
            flush=True,
        )


def decoding_rate(recording: Recording, frames: int) -> float:
    """Multi-view frames per second when nothing is done with the pictures, without opening the files."""
    start = recording.first_frame
    pictures = prefetch(
        read_prepared(recording, lambda camera, frame, image: None, start, start + frames, planes=True), FRAMES_AHEAD
    )
    next(pictures)
    begin = time.perf_counter()
    count = sum(1 for _ in pictures)
    return count / (time.perf_counter() - begin)


if __name__ == "__main__":
    run_script(main)
