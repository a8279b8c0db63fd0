"""What it costs to decode a recording's videos and to cut their pictures into cells.

python benchmarks/decoding.py FOLDER [FRAMES]
"""

import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from quantities import Quantity

from sogjax.io.plane_video import pyav_version
from sogjax.io.recording import Recording, open_recording
from sogjax.io.video import read_prepared
from sogjax.run.clip import cell_grids
from sogjax.scene.cells import padded_cells, stack_shape

DEPTH = 8
"""Of the quad-tree: that of the default settings."""
REPEATS = 4


def decoding_quantities(recording: Recording, frames: int) -> Iterator[Quantity]:
    """Processor time for one picture of every camera, by OpenCV and as the tracker takes it; in turns."""
    grids = cell_grids(recording, DEPTH)
    cells = lambda camera, frame, image: padded_cells(image, grids[camera], stack_shape(grids))
    ways: dict[str, tuple[Callable[[int, int, Any], Any], bool]] = {
        "pictures by OpenCV": (lambda camera, frame, image: None, False),
        "cells from pictures by OpenCV": (cells, False),
    }
    if pyav_version() is not None:
        ways |= {
            "a video's own colours by PyAV": (lambda camera, frame, image: None, True),
            "cells from a video's own colours by PyAV": (cells, True),
        }
    times: dict[str, list[float]] = {way: [] for way in ways}
    for _ in range(REPEATS):
        for way, (prepare, planes) in ways.items():
            times[way].append(processor_milliseconds(recording, frames, prepare, planes))
    for way, found in times.items():
        yield Quantity("decoding", way, min(found), "ms")


def processor_milliseconds(
    recording: Recording, frames: int, prepare: Callable[[int, int, Any], Any], planes: bool
) -> float:
    """Of one frame of all cameras, without opening the files."""
    start = recording.first_frame
    pictures = read_prepared(recording, prepare, start, start + frames, planes=planes)
    next(pictures)
    begin = time.process_time()
    count = sum(1 for _ in pictures)
    return 1000.0 * (time.process_time() - begin) / count


if __name__ == "__main__":
    folder, *rest = sys.argv[1:]
    for quantity in decoding_quantities(open_recording(Path(folder)), int(rest[0]) if rest else 40):
        print(f"{quantity.name:<48}{quantity.value:>10.1f} ms of processor time per frame", flush=True)
