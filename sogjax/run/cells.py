"""The cells of a recording's frames, from the cache if there is one, else from the videos."""

from collections.abc import Iterator

import numpy as np

from sogjax.errors import InputError
from sogjax.io.cell_cache import Cells, CellsOfClip, cell_cache
from sogjax.io.recording import Recording
from sogjax.run.pipeline import Picture, PictureReader, Preparation, read_pictures
from sogjax.run.terminal import say
from sogjax.scene.cells import CellGrid
from sogjax.settings.method import ImagesConfig


def picture_reader(images: ImagesConfig) -> PictureReader:
    """A reader of pictures that uses cached cells where they suffice, and else decodes the videos and caches the cells.

    Reading raises an InputError if a picture cannot be read or the cache's folder cannot be written.
    """
    folder = images.cache
    if folder is None:
        return read_pictures

    def read(recording: Recording, preparation: Preparation, first: int, last: int) -> Iterator[list[Picture]]:
        if not recording.complete:
            say("images.cache: not used for this recording, since cameras are missing in some frames")
            return read_pictures(recording, preparation, first, last)
        cache = cell_cache(folder, recording, images.depth, say)
        kept = cache.find(first, last)
        if kept is not None and preparation.cells_only:
            return pictures_of(kept)
        decoded = read_pictures(recording, preparation, first, last)
        return decoded if kept is not None else cache.kept(first, last, decoded, cells_of)

    return read


def pictures_of(clip: CellsOfClip) -> Iterator[list[Picture]]:
    """Pictures of which only the cells are known."""
    for cells in clip:
        yield [Picture(np.asarray(of_camera), None, None, 0.0) for of_camera in cells]


def cells_of(pictures: list[Picture]) -> Cells:
    """The cells of all cameras."""
    return np.stack([picture.cells for picture in pictures if picture.cells is not None])


def cells_of_clip(
    recording: Recording, grids: tuple[CellGrid, ...], images: ImagesConfig, frames: tuple[int, int]
) -> CellsOfClip:
    """The cells of all frames at once; memory-mapped if they are cached.

    Raises:
        InputError: cameras are missing in some frames.
    """
    if not recording.complete:
        raise InputError(
            f"{recording.path}: cameras are missing in some frames, but a whole clip of cells needs all of them"
        )
    if images.cache is not None:
        kept = cell_cache(images.cache, recording, images.depth, say).find(*frames)
        if kept is not None:
            return kept
    read = picture_reader(images)
    return np.stack([cells_of(pictures) for pictures in read(recording, Preparation(grids), *frames)])
