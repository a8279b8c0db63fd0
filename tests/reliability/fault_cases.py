"""The faults of `faults.py`, by name."""

import os
import resource
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml
from faults import SAME, Survived, Ward, said_by
from kill_and_resume import frames_left, killed_and_resumed, started

from sogjax.errors import InputError
from sogjax.io.array_log import ROWS
from sogjax.io.cell_store import CELLS
from sogjax.io.frame_motions import FRAMES, PARTIAL
from sogjax.io.npz_file import npy_header

FIRST_FRAMES = 8
LATER_FRAMES = 24
LIGHT = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false")


def killed(ward: Ward) -> Survived:
    """SIGKILL at random moments."""
    count = ward.settings.kills
    done = f"SIGKILL at {count} random moments, every other one soon after frames were written"
    try:
        kills = killed_and_resumed(ward.settings, ward.alone, ward.place)
    except InputError as error:
        return Survived("killed", done, "nothing (-9)", "", f"NOT THE SAME: {error}", good=False)
    end = f"of all {kills.runs} runs {SAME}"
    return Survived("killed", done, "nothing (-9)", ", ".join(map(str, kills.left)), end)


def interrupted(ward: Ward) -> list[Survived]:
    """SIGINT and SIGTERM."""
    rows = []
    for name, status in (("SIGINT", 130), ("SIGTERM", 143)):
        folder = ward.place / name
        process = after_frames(ward.alone.command, folder, FIRST_FRAMES)
        process.send_signal(getattr(signal, name))
        done = f"{name} when {FIRST_FRAMES} frames could be read"
        rows.append(ward.resumed("told to stop", done, folder, said_by(process), status=status))
    return rows


def full_disk(ward: Ward) -> list[Survived]:
    """Files that may not grow beyond some bytes (RLIMIT_FSIZE)."""
    motion = (ward.place / "alone/motion.npz").stat().st_size
    file = (ward.place / "alone/motion.rrd").stat().st_size
    return [limited(ward, "the log of frames", motion * 3 // 4), limited(ward, "motion.rrd", file // 2)]


def limited(ward: Ward, name: str, limit: int) -> Survived:
    """A run whose files must not exceed a limit."""
    folder = ward.place / f"limit_{limit}"
    process = started(ward.alone.command, folder)
    resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (limit, limit))  # long before it writes
    done = f"no file may exceed {limit} bytes, which are too few for {name}"
    return ward.resumed("full disk", done, folder, said_by(process))


def damaged_video(ward: Ward) -> list[Survived]:
    """Zeros in the middle of a video whose size and time of change stay the same."""
    zeros = "zeros over the fifth of a video behind 2/5 of it, its size and time as before"
    return [restored_video(ward, zeros), missing_camera(ward, zeros)]


def restored_video(ward: Ward, zeros: str) -> Survived:
    """All cameras are needed, so the run stops; then the video is put right."""
    command, video = with_own_recording(ward, "recording")
    folder, content = ward.place / "damaged_video", video.read_bytes()
    put(video, with_zeros(content))
    said = said_by(started(command, folder))
    put(video, content)
    row = ward.resumed("damaged video", f"{zeros}; then the video as it was", folder, said, command)
    return row if video.name in said.last else replace(row, good=False)


def missing_camera(ward: Ward, zeros: str) -> Survived:
    """Two cameras are enough, so the run goes on to its end."""
    command, video = with_own_recording(ward, "lenient_recording")
    settings = video.parents[1] / "recording.yaml"
    settings.write_text(yaml.safe_dump(yaml.safe_load(settings.read_text()) | {"fewest_cameras": 2}))
    put(video, with_zeros(video.read_bytes()))
    folder = ward.place / "missing_camera"
    said = said_by(started(command, folder), about="no picture")
    frames = frames_left(folder)
    end = "not needed: the run came to its end with the other cameras"
    good = said.status == 0 and frames == ward.settings.frames and video.stem in said.last
    return Survived("damaged video", f"{zeros}; `fewest_cameras: 2`", str(said), str(frames), end, good)


def with_own_recording(ward: Ward, name: str) -> tuple[list[str], Path]:
    """The command with a copy of the recording, and a video of the copy."""
    key = "recording="
    words = ward.alone.command
    original = next(word for word in words if word.startswith(key)).removeprefix(key)
    copy = Path(shutil.copytree(original, ward.place / name / Path(original).name))
    command = [f"{key}{copy}" if word.startswith(key) else word for word in words]
    return command, sorted((copy / "videos").iterdir())[0]


def with_zeros(content: bytes) -> bytes:
    """Two fifths, a fifth of zeros, two fifths."""
    begin, end = len(content) * 2 // 5, len(content) * 3 // 5
    return content[:begin] + bytes(end - begin) + content[end:]


def put(path: Path, content: bytes) -> None:
    """Another content with the same time of change."""
    state = path.stat()
    path.write_bytes(content)
    os.utime(path, ns=(state.st_atime_ns, state.st_mtime_ns))


def power_loss(ward: Ward) -> list[Survived]:
    """The last record of the log lost in part, or something else behind it."""
    cuts = {
        "half of the last record of the log cut off": lambda content, row: content[: -row // 2],
        "10 records of random bytes behind the log": lambda content, row: (
            content + np.random.default_rng(0).bytes(10 * row)
        ),
    }
    rows = []
    for k, (what, change) in enumerate(cuts.items()):
        folder = ward.place / f"power_{k}"
        process = after_frames(ward.alone.command, folder, LATER_FRAMES)
        process.kill()
        said = said_by(process)
        log = folder / PARTIAL / FRAMES / ROWS
        with log.open("rb") as file:
            row = npy_header(file)[1].itemsize
        log.write_bytes(change(log.read_bytes(), row))
        row = ward.resumed("loss of power", f"SIGKILL, and {what}", folder, said, status=-signal.SIGKILL)
        rows.append(replace(row, good=row.good and int(row.frames) >= LATER_FRAMES - 1))
    return rows


def second_run(ward: Ward) -> Survived:
    """The same command again while it runs."""
    folder = ward.place / "two_runs"
    first = after_frames(ward.alone.command, folder, FIRST_FRAMES)
    first.send_signal(signal.SIGSTOP)  # else it might end before the other one has begun
    said = said_by(started([*ward.alone.command, "overwrite=true"], folder))
    first.send_signal(signal.SIGCONT)
    frames = frames_left(folder)
    end, same = ward.compared(folder, said_by(first))
    done = "a second run with overwrite=true into the folder of one that runs"
    return Survived(
        "second run", done, str(said), str(frames), f"not needed: that of the first is {end}", same and said.status == 2
    )


def damaged_cells(ward: Ward) -> Survived:
    """A bit of the kept cells is flipped."""
    cells = ward.place / "cells"
    command = [*ward.alone.command, f"images.cache={cells}", *LIGHT]
    light = replace(ward, settings=replace(ward.settings, overlay=False))
    _, made = light.compared(ward.place / "cells_made", said_by(started(command, ward.place / "cells_made")))
    (file,) = cells.glob(f"*/{CELLS}")
    content = file.read_bytes()
    middle = len(content) // 2
    file.write_bytes(content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :])
    said = said_by(started(command, ward.place / "cells_again"), about="images.cache")
    frames = frames_left(ward.place / "cells_again")
    end, same = light.compared(ward.place / "cells_again", said)
    good = made and same and file.read_bytes() == content
    end = f"not needed: {end}, and so are the cells" if good else end
    return Survived(
        "damaged cells",
        "a bit in the middle of the kept cells (images.cache) flipped",
        str(said),
        str(frames),
        end,
        good,
    )


def deleted_folder(ward: Ward) -> list[Survived]:
    """The folder of the results is removed below a program that runs."""
    rows = []
    for count in (FIRST_FRAMES, LATER_FRAMES):
        folder = ward.place / f"deleted_{count}"
        process = after_frames(ward.alone.command, folder, count)
        for _ in range(20):
            shutil.rmtree(folder, ignore_errors=True)
        done = f"the folder of the results deleted when {count} frames could be read"
        rows.append(ward.resumed("deleted folder", done, folder, said_by(process)))
    return rows


def after_frames(command: Sequence[str], folder: Path, count: int) -> subprocess.Popen:
    """A run, as soon as so many frames can be read."""
    process = started(list(command), folder)
    while process.poll() is None and frames_left(folder) < count:
        time.sleep(0.02)
    return process


FAULTS: dict[str, Callable[[Ward], Survived | list[Survived]]] = {
    "damaged video": damaged_video,
    "full disk": full_disk,
    "deleted folder": deleted_folder,
    "second run": second_run,
    "damaged cells": damaged_cells,
    "loss of power": power_loss,
    "told to stop": interrupted,
    "killed": killed,
}
