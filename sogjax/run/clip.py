"""A recording opened for reading: the one door to its frames, each of which is decoded once."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import cv2
import numpy as np
from jaxtyping import UInt8

from sogjax.errors import InputError
from sogjax.io.cell_store import CellStore, Samples, store_name
from sogjax.io.recording import Recording
from sogjax.io.threads import prefetch
from sogjax.io.video import read_prepared
from sogjax.model.yuv_picture import YuvPicture
from sogjax.run.clip_keypoints import ClipKeypoints
from sogjax.run.clock import StageTimes
from sogjax.run.small_pictures import FOLDER, SmallPictures
from sogjax.run.terminal import say
from sogjax.scene.background_difference import working_size
from sogjax.scene.cells import CellGrid, padded_cells, stack_shape
from sogjax.tracking.frame import FrameInput

FRAMES_AHEAD = 3
"""Decoded frames that wait for whoever takes them, at most."""
BLOCK = 32
"""Frames that are decoded at once where they are wanted backwards."""

Kept = TypeVar("Kept")

PictureMaker = Callable[[int, int, np.ndarray], Any]
"""Makes something of a picture (BGR) while it is there, from the camera's index, the frame and the picture."""


@dataclass(frozen=True)
class SampleKind:
    """Pictures that are taken of a few frames of each camera, such as those that a background is learnt from."""

    name: str
    frames: tuple[int, ...]
    """Ascending."""
    prepare: Callable[[int, np.ndarray], UInt8[np.ndarray, "_rows _columns 3"]]
    """Makes what is taken of a camera's picture (BGR)."""

    @classmethod
    def at_working_size(cls, name: str, recording: Recording, frames: Sequence[int]) -> "SampleKind":
        """Pictures at the size at which backgrounds are learnt and compared."""
        sizes = [working_size(*recording.rig.image_size(camera)) for camera in recording.rig.names]
        small = lambda camera, picture: cv2.resize(picture, sizes[camera], interpolation=cv2.INTER_AREA)
        return cls(name, tuple(frames), small)


def spread_frames(frames: range, most: int) -> list[int]:
    """At most so many of the frames of a clip, evenly spread, the first and the last among them."""
    rows = np.unique(np.linspace(0, len(frames) - 1, min(most, len(frames))).round().astype(int)).tolist()
    return [frames[row] for row in rows]


class ReadFrame(NamedTuple):
    """A frame as it was read."""

    input: FrameInput
    pictures: list[Any]
    """What was made of the picture of each camera; None where it has none, or nothing was to be made."""


@dataclass(frozen=True)
class Clip:
    """The frames of a recording that a run is about; frames are the recording's numbers."""

    recording: Recording
    numbers: range
    """The frames to track, in their order."""
    depth: int
    """Depth of the quad-trees whose cells are read."""
    keypoints: ClipKeypoints | None = None
    """What detectors saw; None: there are no files, or they do not count."""
    store: CellStore | None = None
    """Where cells are kept, so that no frame is decoded twice; None: nowhere."""
    store_lasts: bool = False
    """Whether the user named the store's folder: trouble with it is an error then."""
    small: SmallPictures | None = None
    """Takes small pictures of some frames whenever these are decoded; None: none are wanted."""

    @property
    def fps(self) -> float:
        """Frames per second of those to track."""
        return self.recording.fps / self.numbers.step

    @cached_property
    def grids(self) -> tuple[CellGrid, ...]:
        """How the pictures of each camera are cut into cells."""
        return cell_grids(self.recording, self.depth)

    def kept_in(self, folder: Path, cache: str | None) -> "Clip":
        """The clip with its cells kept in a folder, or for good in `cache`, the folder that the user named.

        Raises:
            InputError: the folder cannot be written.
        """
        place = folder / "cells" if cache is None else Path(cache) / store_name(self.recording, self.depth)
        shape = (len(self.grids), *stack_shape(self.grids))
        store = CellStore(place, self.recording, self.depth, shape, say)
        return replace(self, store=store, store_lasts=cache is not None)

    def shown_small(self, folder: Path, most: int) -> "Clip":
        """The clip with small pictures of so many frames at most, kept in a folder."""
        return replace(self, small=SmallPictures(self.recording, spread_frames(self.numbers, most), folder / FOLDER))

    def close(self) -> None:
        """Close the files of kept cells; they are opened again where they are needed."""
        if self.store is not None:
            self.store.close()

    def frames(self, first: int | None = None, stop: int | None = None, step: int = 1) -> Iterator[FrameInput]:
        """What is known of frames, in the order of the range; of all frames to track where no range is given.

        Raises:
            InputError: a video ends early or changes its size, or a frame has no picture at all.
        """
        numbers = self.numbers if first is None or stop is None else range(first, stop, step)
        return (frame.input for frame in self.read(numbers))

    def read(
        self, numbers: range, make: PictureMaker | None = None, times: StageTimes | None = None
    ) -> Iterator[ReadFrame]:
        """Frames with what `make` makes of their pictures, for which these must be decoded.

        `times` notes how long each frame was waited for, and its averaging took.

        Raises:
            InputError: as `frames`.
        """
        if numbers.step < 0:
            for first in range(0, len(numbers), BLOCK):
                yield from reversed(list(self.read(numbers[first : first + BLOCK][::-1], make, times)))
            return
        kept = np.zeros(len(numbers), bool) if self.store is None or make else self.store.kept(numbers)
        for is_kept, rows in groupby(range(len(numbers)), lambda row: bool(kept[row])):
            found = [*rows]
            part = numbers[found[0] : found[-1] + 1]
            yield from self._kept(part) if is_kept else self._decoded(part, make, times)

    def sampled(self, kinds: Sequence[SampleKind]) -> list[Samples]:
        """The samples of several kinds, which are taken at once, and only once where they are kept.

        Raises:
            InputError: a video ends early or changes its size.
        """
        missing = [kind for kind in kinds if self.store is None or not self.store.has_samples(kind.name)]
        taken: dict[str, Samples] = {}
        if missing:
            taken = self._taken(missing)
            for name, samples in taken.items():
                if (kept := self._kept_on_disk(lambda store, of=(name, samples): store.keep_samples(*of))) is not None:
                    taken[name] = kept
        return [
            taken[kind.name] if kind.name in taken or self.store is None else self.store.samples(kind.name)
            for kind in kinds
        ]

    def _taken(self, kinds: Sequence[SampleKind]) -> dict[str, Samples]:
        """Samples of several kinds; on the way, the cells of the frames to track are kept."""
        wanted = {kind.name: frozenset(kind.frames) for kind in kinds}
        every = range(min(min(kind.frames) for kind in kinds), max(max(kind.frames) for kind in kinds) + 1)
        tracked = range(min(self.numbers), max(self.numbers) + 1)
        needed = (
            np.isin(np.asarray(every), np.asarray(tracked)) if self.store is not None else np.zeros(len(every), bool)
        )
        if self.store is not None:
            needed &= ~self.store.kept(every)

        def make(camera: int, frame: int, picture: np.ndarray) -> dict[str, np.ndarray]:
            return {kind.name: kind.prepare(camera, picture) for kind in kinds if frame in wanted[kind.name]}

        known = frozenset(np.asarray(every)[~needed].tolist())
        preparation = _Preparation(self.grids, known, frozenset().union(*wanted.values()), make, self.small)
        taken: dict[str, Samples] = {kind.name: [{} for _ in self.grids] for kind in kinds}
        for number, made in zip(
            every, read_prepared(self.recording, preparation, every.start, every.stop, planes=True), strict=False
        ):
            if any(picture.cells is not None for picture in made):
                self._known(number, [picture.cells for picture in made], needed=False)
            for camera, picture in enumerate(made):
                for name, sample in (picture.made or {}).items():
                    taken[name][camera][number] = sample
        return taken

    def _kept(self, numbers: range) -> Iterator[ReadFrame]:
        assert self.store is not None
        for number in numbers:
            found = self.store.find(number)
            if found is None:  # damaged
                yield from self._decoded(range(number, number + 1), None, None)
            else:
                yield ReadFrame(self._input(number, *found), [])

    def _decoded(self, numbers: range, make: PictureMaker | None, times: StageTimes | None) -> Iterator[ReadFrame]:
        """Decode from the first to the last of some frames, and keep the cells of all of them."""
        every = range(numbers[0], numbers[-1] + 1)
        kept = np.zeros(len(every), bool) if self.store is None else self.store.kept(every)
        preparation = _Preparation(
            self.grids, frozenset(np.asarray(every)[kept].tolist()), frozenset(numbers), make, self.small
        )
        pictures = read_prepared(self.recording, preparation, every.start, every.stop, planes=True)
        with closing(prefetch(pictures, FRAMES_AHEAD)) as ready:
            coming = ready if times is None else times.timed("decode", ready)
            for number, made in zip(every, coming, strict=False):
                if times is not None:
                    times.add("cells", sum(picture.seconds for picture in made))
                frame = self._known(number, [picture.cells for picture in made], number in numbers)
                if number in numbers and frame is not None:
                    yield ReadFrame(frame, [picture.made for picture in made])

    def _known(
        self, number: int, cells: Sequence[UInt8[np.ndarray, "rows columns 3"] | None], needed: bool
    ) -> FrameInput | None:
        """A frame from its cells, which are kept, or else from what was kept of it; None where it has no picture."""
        found = None if self.store is None or any(part is not None for part in cells) else self.store.find(number)
        if found is not None:
            return self._input(number, *found)
        some = next((of_camera for of_camera in cells if of_camera is not None), None)
        if some is None:
            if needed:
                raise InputError(
                    f"{self.recording.path}: no camera has frame {number}; track the frames before or after it "
                    "(start=, stop=)"
                )
            return None
        stacked = np.stack([np.zeros_like(some) if of_camera is None else of_camera for of_camera in cells])
        present = np.array([of_camera is not None for of_camera in cells])
        self._kept_on_disk(lambda store: store.keep(number, stacked, present))
        return self._input(number, stacked, present)

    def _kept_on_disk(self, keep: Callable[[CellStore], Kept]) -> Kept | None:
        """What comes of keeping something; None: nothing is kept, or any more since the disk became full."""
        if self.store is None or self.store.is_full:
            return None
        try:
            return keep(self.store)
        except InputError as error:
            if self.store_lasts:
                raise
            self.store.is_full = True
            say(f"warning: {error}; frames are decoded again where they are needed again")
            return None

    def _input(self, number: int, cells: np.ndarray, present: np.ndarray) -> FrameInput:
        seen = None if self.keypoints is None else self.keypoints.of_frame(number)
        return FrameInput(cells, None if present.all() else present, seen)


def cell_grids(recording: Recording, depth: int) -> tuple[CellGrid, ...]:
    """How the pictures of each camera are cut into cells."""
    sizes = np.asarray(recording.rig.cameras.image_size).astype(int)
    return tuple(CellGrid.from_depth(int(width), int(height), depth) for width, height in sizes)


class _Prepared(NamedTuple):
    """What is kept of one camera's picture."""

    cells: UInt8[np.ndarray, "rows columns 3"] | None
    """None where the camera is missing, or the cells of the frame are known."""
    made: Any
    seconds: float
    """Time that the cells took."""


@dataclass(frozen=True)
class _Preparation:
    """What the decoding threads make of each picture before they drop it."""

    grids: tuple[CellGrid, ...]
    known: frozenset[int]
    """Frames whose cells are known."""
    shown: frozenset[int]
    """Frames of whose pictures something is made."""
    make: PictureMaker | None
    small: SmallPictures | None = None

    def __call__(self, camera: int, frame: int, image: np.ndarray | YuvPicture | None) -> _Prepared:
        if image is None:
            return _Prepared(None, None, 0.0)
        begin = time.perf_counter()
        cells = None if frame in self.known else padded_cells(image, self.grids[camera], stack_shape(self.grids))
        seconds = time.perf_counter() - begin
        make = self.make if frame in self.shown else None
        small = self.small if self.small is not None and self.small.lacks(camera, frame) else None
        if make is None and small is None:
            return _Prepared(cells, None, seconds)
        whole = image.bgr() if isinstance(image, YuvPicture) else image
        if small is not None:
            small.take(camera, frame, whole)
        return _Prepared(cells, None if make is None else make(camera, frame, whole), seconds)
