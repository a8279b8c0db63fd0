"""The cells of a recording's frames for a command: from the cache where there is one, else from the videos."""

from collections.abc import Iterator

import numpy as np

from sogjax.data.cell_cache import Cells, CellsOfClip, cell_cache
from sogjax.data.recording import Recording
from sogjax.data.video import read_prepared
from sogjax.engine.pipeline import Picture, PictureReader, Preparation
from sogjax.engine.terminal import say
from sogjax.errors import InputError
from sogjax.images.cells import CellGrid
from sogjax.settings import ImagesConfig


def picture_reader(images: ImagesConfig) -> PictureReader:
    """What reads the pictures of a recording: kept cells where they are enough, else the videos, whose cells are kept.

    Reading raises an InputError where a picture cannot be read, or the cache's folder cannot be written.
    """
    folder = images.cache
    if folder is None:
        return read_prepared

    def read(recording: Recording, preparation: Preparation, first: int, last: int) -> Iterator[list[Picture]]:
        if not recording.complete:
            say("images.cache: no cells are kept of a recording in which cameras are missing for a while")
            return read_prepared(recording, preparation, first, last)
        cache = cell_cache(folder, recording, images.depth, say)
        kept = cache.find(first, last)
        if kept is not None and preparation.cells_only:
            return pictures_of(kept)
        decoded = read_prepared(recording, preparation, first, last)
        return decoded if kept is not None else cache.kept(first, last, decoded, cells_of)

    return read


def pictures_of(clip: CellsOfClip) -> Iterator[list[Picture]]:
    """Pictures of which nothing but cells is known."""
    for cells in clip:
        yield [Picture(np.asarray(of_camera), None, None, 0.0) for of_camera in cells]


def cells_of(pictures: list[Picture]) -> Cells:
    """The cells of all cameras."""
    return np.stack([picture.cells for picture in pictures if picture.cells is not None])


def cells_of_clip(
    recording: Recording, grids: tuple[CellGrid, ...], images: ImagesConfig, frames: tuple[int, int]
) -> CellsOfClip:
    """Those of all frames at once; memory-mapped where they are kept.

    Raises:
        InputError: cameras are missing for a while.
    """
    if not recording.complete:
        raise InputError(
            f"{recording.path}: cameras are missing for a while, which sweep=vmapped does not know of; leave it out"
        )
    if images.cache is not None:
        kept = cell_cache(images.cache, recording, images.depth, say).find(*frames)
        if kept is not None:
            return kept
    read = picture_reader(images)
    return np.stack([cells_of(pictures) for pictures in read(recording, Preparation(grids), *frames)])
