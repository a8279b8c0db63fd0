"""A recording in place of cameras: its pictures come when their time is there; what goes wrong is drawn by a seed."""

import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain, count
from threading import Event
from typing import Any

import numpy as np

from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.io.video import read_prepared
from sogjax.realtime.pictures import Picture, Taken
from sogjax.run.recordings import with_cameras
from sogjax.settings.live import FaultsConfig


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
        for key in ("delay", "gone"):
            strange = [str(name) for name in getattr(config, key) or {} if str(name) not in names]
            if strange:
                raise InputError(f"faults.{key}: there is no camera {strange[0]!r}; there are {', '.join(names)}")
        if not 0.0 <= config.drop < 1.0 or config.jitter < 0.0:
            raise InputError(
                f"faults.drop={config.drop} faults.jitter={config.jitter}: the first is a share below 1, the second "
                "seconds; correct them"
            )
        of = lambda values, default: {str(name): value for name, value in (values or {}).items()}.get(
            names[camera], default
        )
        first, last = (float(value) for value in of(config.gone, (0.0, 0.0)))
        delay = float(of(config.delay, 0.0))
        return cls(config.drop, delay, config.jitter, (first, last), (config.seed, camera))


@dataclass
class Beginning:
    """When the replay begins, for all of its cameras."""

    time: float = 0.0
    known: Event = field(default_factory=Event)

    def now(self) -> None:
        """Begin."""
        self.time = time.monotonic()
        self.known.set()


class ReplayCamera:
    """One camera of a replayed recording.

    Args:
        recording: that is replayed.
        camera: which of its cameras.
        beginning: shared by all cameras.
        faults: of this camera.
        first: the frame (the recording's number) with which the replay begins.
        speed: as a multiple of the recording's rate.
        loop: whether it begins again when it has ended.
    """

    def __init__(
        self,
        recording: Recording,
        camera: str,
        beginning: Beginning,
        faults: Faults,
        *,
        first: int,
        speed: float = 1.0,
        loop: bool = False,
    ) -> None:
        self._name, self._beginning, self._faults = camera, beginning, faults
        self._recording, self._loop = with_cameras(recording, [camera]), loop
        self._first, self._period = first, 1.0 / (recording.fps * speed)
        self._closed, self._pictures = Event(), self._frames()

    @property
    def name(self) -> str:
        """What the calibration calls it."""
        return self._name

    def read(self) -> Taken | None:
        """The next picture, decoded ahead and handed over when it is due; None: the replay has ended, or was closed."""
        for number, picture, due, late in self._pictures:
            self._beginning.known.wait()
            exposed = self._beginning.time + due
            if self._closed.wait(max(exposed + late - time.monotonic(), 0.0)):
                break
            return Taken(picture, exposed, time.monotonic(), number)
        return None

    def close(self) -> None:
        """Stop; the thread that reads ends at its next picture."""
        self._closed.set()
        self._beginning.known.set()

    def _frames(self) -> Iterator[tuple[int, Picture, float, float]]:
        """Number, picture, when it is due after the beginning, and by how much it is late, of those that come."""
        drawn, faults, place = np.random.default_rng(self._faults.seed), self._faults, count()
        frames = range(self._first, self._recording.frames.stop)
        again = count() if self._loop else range(1)
        passes = (range(self._recording.frames.start if k else frames.start, frames.stop) for k in again)
        for number, picture in chain.from_iterable(self._decoded(numbers) for numbers in passes):
            due = next(place) * self._period
            lost, late = drawn.random() < faults.drop, abs(drawn.normal(0.0, faults.jitter)) if faults.jitter else 0.0
            if self._closed.is_set():
                return
            if picture is not None and not lost and not faults.gone[0] <= due < faults.gone[1]:
                yield number, picture, due, faults.delay + late

    def _decoded(self, numbers: range) -> Iterator[tuple[int, Any]]:
        as_is = lambda camera, frame, image: image
        read = read_prepared(self._recording, as_is, numbers.start, numbers.stop, planes=True)
        for number, (picture,) in zip(numbers, read, strict=False):
            yield number, picture


def replay_cameras(
    recording: Recording, config: FaultsConfig, first: int, speed: float, loop: bool
) -> tuple[list[ReplayCamera], Beginning]:
    """All cameras of a recording, from its frame `first` on, and what lets them begin.

    Raises:
        InputError: faults of cameras that there are not, or a speed that is not positive.
    """
    if not speed > 0.0:
        raise InputError(f"speed={speed}: must be positive; 1 is the recording's own rate")
    beginning, names = Beginning(), recording.rig.names
    return [
        ReplayCamera(
            recording,
            name,
            beginning,
            Faults.of_camera(config, names, camera),
            first=first,
            speed=speed,
            loop=loop,
        )
        for camera, name in enumerate(names)
    ], beginning
