"""The cells of a recording's frames for a command: from the cache where there is one, else from the videos."""

import time
from collections.abc import Iterator

import numpy as np

from sogjax.app.configs import ImagesConfig
from sogjax.app.recordings import say
from sogjax.app.timing import StageTimes
from sogjax.data.cell_cache import Cells, CellsOfClip, cell_cache
from sogjax.data.recording import Recording
from sogjax.data.video import read_frames
from sogjax.images.cells import CellGrid, stack_cells


def cell_frames(
    recording: Recording,
    grids: tuple[CellGrid, ...],
    images: ImagesConfig,
    frames: tuple[int, int],
    times: StageTimes,
) -> Iterator[Cells]:
    """The cells of the frames from the first to before the last; decoded pictures are kept where a cache is wanted.

    Raises:
        InputError: a picture cannot be read, or the cache's folder cannot be written.
    """
    if images.cache is None:
        return decoded_cells(recording, grids, frames, times)
    cache = cell_cache(images.cache, recording, images.depth, say)
    kept = cache.find(*frames)
    return cache.kept(*frames, decoded_cells(recording, grids, frames, times)) if kept is None else iter(kept)


def decoded_cells(
    recording: Recording, grids: tuple[CellGrid, ...], frames: tuple[int, int], times: StageTimes
) -> Iterator[Cells]:
    """The same from the videos."""
    for pictures in times.timed("decode", read_frames(recording, *frames)):
        begin = time.perf_counter()
        stacked = stack_cells(pictures, grids)
        times.add("cells", time.perf_counter() - begin)
        yield stacked


def cells_of_clip(
    recording: Recording, grids: tuple[CellGrid, ...], images: ImagesConfig, frames: tuple[int, int], times: StageTimes
) -> CellsOfClip:
    """All of them at once; memory-mapped where they were kept."""
    if images.cache is not None:
        kept = cell_cache(images.cache, recording, images.depth, say).find(*frames)
        if kept is not None:
            return kept
    return np.stack(list(cell_frames(recording, grids, images, frames, times)))
