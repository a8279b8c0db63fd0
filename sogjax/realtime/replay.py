"""A recording in place of cameras: its pictures come when their time is there; what goes wrong is drawn by a seed."""

import math
import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import chain, count
from threading import Condition, Event
from typing import Any

import numpy as np

from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.io.video import read_prepared
from sogjax.realtime.pictures import Taken
from sogjax.run.recordings import with_cameras
from sogjax.settings.live import FaultsConfig

KEPT = 64
"""Times of frames that are kept: a camera is at most one behind the others."""


@dataclass(frozen=True)
class Faults:
    """What goes wrong with one camera; times are seconds."""

    drop: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    gone: tuple[float, float] = (0.0, 0.0)
    """From when to when of the replay nothing comes."""
    seed: tuple[int, int] = (0, 0)

    @classmethod
    def of_camera(cls, config: FaultsConfig, names: tuple[str, ...], camera: int) -> "Faults":
        """What the settings say of one of the cameras.

        Raises:
            InputError: a number out of range, or a camera that there is not.
        """
        if not 0.0 <= config.drop < 1.0 or not config.jitter >= 0.0:
            raise InputError(
                f"faults.drop={config.drop} faults.jitter={config.jitter}: the first is a share below 1, the second "
                "seconds; correct them"
            )
        (delay,) = _of_camera("delay", config.delay, names, camera, ("SECONDS",))
        first, last = _of_camera("gone", config.gone, names, camera, ("FROM", "TO"))
        return cls(config.drop, delay, config.jitter, (first, last), (config.seed, camera))


def _of_camera(
    key: str, values: Any, names: tuple[str, ...], camera: int, meaning: tuple[str, ...]
) -> tuple[float, ...]:
    """The seconds that are given for a camera, as many as have a meaning; 0 where none are."""
    given = {} if values is None else values
    form = f"{{CAMERA:{meaning[0] if len(meaning) == 1 else '[' + ','.join(meaning) + ']'}}}"
    if not isinstance(given, Mapping):
        raise InputError(f"faults.{key}={values}: should be {form}, in seconds")
    strange = [str(name) for name in given if str(name) not in names]
    if strange:
        raise InputError(f"faults.{key}: there is no camera {strange[0]!r}; there are {', '.join(names)}")
    value = {str(name): value for name, value in given.items()}.get(names[camera], [0.0] * len(meaning))
    seconds = value if isinstance(value, list | tuple) else [value]
    if len(seconds) != len(meaning) or not all(isinstance(each, int | float) and each >= 0.0 for each in seconds):
        raise InputError(f"faults.{key}: {names[camera]} has {value}; should be {form}, in seconds from 0 on")
    return tuple(map(float, seconds))


class Pace:
    """The clock of a replay, which all of its cameras share.

    A frame is due when all of them have decoded it: where that takes longer than its time, the clock stands still
    meanwhile, and the replay is slower than asked for.

    Args:
        num_cameras: that must have a frame.
        period: seconds from one frame to the next.
    """

    def __init__(self, num_cameras: int, period: float) -> None:
        self._num_cameras, self.period = num_cameras, period
        self._changed, self._closed = Condition(), False
        self._begin: float | None = None
        self._ready: Counter[int] = Counter()
        self._due: dict[int, float] = {}
        self.slipped = 0.0
        """Seconds that the clock stood still."""

    def begin(self) -> None:
        """Begin, when whoever gets the pictures is ready."""
        with self._changed:
            self._begin = time.monotonic() + self.period
            self._release()

    def close(self) -> None:
        """Let nobody wait any more."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def due(self, place: int) -> float | None:
        """A camera has the frame at a place: when it is due, once all have it; None: the replay was closed."""
        with self._changed:
            self._ready[place] += 1
            self._release()
            while place not in self._due and not self._closed:
                self._changed.wait()
            return None if self._closed else self._due[place]

    def _release(self) -> None:
        for place in [place for place, ready in self._ready.items() if ready == self._num_cameras]:
            if self._begin is None:
                return
            late = time.monotonic() - (self._begin + place * self.period)
            if late > self.period:
                self._begin += late
                self.slipped += late
            self._due[place] = self._begin + place * self.period
            del self._ready[place]
            self._due.pop(place - KEPT, None)
            self._changed.notify_all()


class ReplayCamera:
    """One camera of a replayed recording.

    Args:
        recording: that is replayed.
        camera: which of its cameras.
        pace: shared by all cameras.
        faults: of this camera.
        first: the frame (the recording's number) with which the replay begins.
        loop: whether it begins again when it has ended.
    """

    def __init__(
        self,
        recording: Recording,
        camera: str,
        pace: Pace,
        faults: Faults,
        *,
        first: int,
        loop: bool = False,
    ) -> None:
        self._name, self._pace, self._faults = camera, pace, faults
        as_filmed = replace(recording, color_gains={})  # whoever gets the pictures evens them out
        self._recording, self._loop, self._first = with_cameras(as_filmed, [camera]), loop, first
        self._closed, self._pictures = Event(), self._frames()

    @property
    def name(self) -> str:
        """What the calibration calls it."""
        return self._name

    def read(self) -> Taken | None:
        """The next picture, decoded ahead and handed over when it is due; None: the replay has ended, or was closed."""
        return next(self._pictures, None)

    def close(self) -> None:
        """Stop; the thread that reads ends soon."""
        self._closed.set()
        self._pace.close()

    def _frames(self) -> Iterator[Taken]:
        """The pictures that come, each when it arrives; those that are late do not keep the next from being decoded."""
        waiting: deque[tuple[float, float, int, Any]] = deque()
        ahead = 1 + math.ceil((self._faults.delay + 3.0 * self._faults.jitter) / self._pace.period)
        coming, more = self._coming(), True
        while more or waiting:
            while more and len(waiting) < ahead:
                if more := (item := next(coming, None)) is not None:
                    waiting.append(item)
            if not waiting:
                return
            arrival, exposed, number, picture = waiting.popleft()
            if self._closed.wait(max(arrival - time.monotonic(), 0.0)):
                return
            if picture is not None:
                yield Taken(picture, exposed, time.monotonic(), number)

    def _coming(self) -> Iterator[tuple[float, float, int, Any]]:
        """When a picture arrives and was taken, its frame, and itself; None where it does not come."""
        drawn, faults, place = np.random.default_rng(self._faults.seed), self._faults, count()
        frames = range(self._first, self._recording.frames.stop)
        again = count() if self._loop else range(1)
        passes = (range(self._recording.frames.start if k else frames.start, frames.stop) for k in again)
        begin = None
        for number, picture in chain.from_iterable(self._decoded(numbers) for numbers in passes):
            exposed = self._pace.due(next(place))
            if exposed is None:
                return
            begin = exposed if begin is None else begin
            lost, late = drawn.random() < faults.drop, abs(drawn.normal(0.0, faults.jitter)) if faults.jitter else 0.0
            lost |= faults.gone[0] <= exposed - begin < faults.gone[1]
            yield exposed + faults.delay + late, exposed, number, None if lost else picture

    def _decoded(self, numbers: range) -> Iterator[tuple[int, Any]]:
        as_is = lambda camera, frame, image: image
        read = read_prepared(self._recording, as_is, numbers.start, numbers.stop, planes=True)
        for number, (picture,) in zip(numbers, read, strict=False):
            yield number, picture


def replay_cameras(
    recording: Recording, config: FaultsConfig, first: int, speed: float, loop: bool
) -> tuple[list[ReplayCamera], Pace]:
    """All cameras of a recording, from its frame `first` on, and their clock, which lets them begin.

    Raises:
        InputError: faults of cameras that there are not.
    """
    names = recording.rig.names
    pace = Pace(len(names), 1.0 / (recording.fps * speed))
    return [
        ReplayCamera(recording, name, pace, of_camera, first=first, loop=loop)
        for name, of_camera in zip(names, faults_of(config, names), strict=True)
    ], pace


def faults_of(config: FaultsConfig, names: tuple[str, ...]) -> list[Faults]:
    """What goes wrong with each of the cameras.

    Raises:
        InputError: a number out of range, or a camera that there is not.
    """
    return [Faults.of_camera(config, names, camera) for camera in range(len(names))]
