"""The search beside the running tracker: a thread finds a pose in frames that were held, then catches up."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event, Lock, Thread
from time import sleep
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, UInt8

from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.realtime.stepping import LiveStep, Moment
from sogjax.run.clip_search import NUM_FOLLOWED, SECONDS, Guess, agreed, likeliest
from sogjax.run.memory import return_freed_memory
from sogjax.run.terminal import say
from sogjax.search.found_pose import Path
from sogjax.search.pose_search import Report, unreported
from sogjax.tracking.frame import FrameInput

MOST_HELD = 256_000_000
"""Bytes of cells that are held while a search goes on; beyond, every other frame is let go."""
NEARLY, HURRY = 3, 6
"""Frames behind the present with which a search has caught up, or as many as come while one is tracked; one of so many
that it is behind is left out, and as many as came meanwhile (the lesser of the last two times: one may be slow)."""
LONGEST_END = 30.0
"""Seconds that a search may take to notice that it was stopped: a thread that computes must not outlive the program."""
LIKELIEST_AFTER = 3
"""Searches that are not sure, after which the likeliest pose is taken."""


@dataclass(frozen=True)
class HeldFrame:
    """What was seen at one moment."""

    cells: UInt8[np.ndarray, "camera rows columns 3"]
    present: Bool[np.ndarray, "camera"]
    exposed: float


@dataclass(frozen=True)
class Found:
    """What came of a search."""

    moment: Moment | None
    """The tracker's memory after the last held frame; None: nobody was found."""
    sentence: str = ""
    exposed: float = 0.0
    """When that frame was taken."""
    energy: float = 0.0
    """Of the pose that was found in it (Eq. 10)."""


@runtime_checkable
class FindsPoses(Protocol):
    """Searches frames for bodies; a `ClipSearch` does."""

    @property
    def bodies(self) -> Sequence[Body]:
        """Who is searched for."""
        ...

    def paths_in(self, frames: Sequence[FrameInput], report: Report = unreported) -> list[Path]:
        """The best poses of all actors in the first of some frames and in the others; `report` is called on the way."""
        ...


class _StoppedError(Exception):
    """A search that nobody waits for any more."""


class SearchBeside:
    """Searches in a thread of its own, one search at a time.

    The frames since a search began are held, at most so many bytes. What was found in the first of them is tracked
    through the others, until it has caught up with the present.

    Args:
        search: of poses in frames.
        step: by which what was found is tracked; another one than the running tracker's, if that makes room meanwhile.
        rest: called in the thread before it begins, such as to make it less urgent.
    """

    def __init__(self, search: FindsPoses, step: LiveStep, rest: Callable[[], object] = lambda: None) -> None:
        self._search, self.step, self._rest = search, step, rest
        self._held: deque[HeldFrame] = deque()
        self._lock, self._found = Lock(), None
        self._thread: Thread | None = None
        self._threads: list[Thread] = []
        self._stopped, self._every, self._place = Event(), 1, 0
        self._unsure = 0
        self.count = 0
        """Searches that were begun."""

    @property
    def busy(self) -> bool:
        """Whether one goes on, or its result was not taken yet."""
        return self._thread is not None

    def begin(self) -> None:
        """Begin a search in the frames that are held from now on."""
        self._held.clear()
        self._every, self._place, self._found = 1, 0, None
        self._stopped = Event()
        self.count += 1
        self._thread = Thread(target=self._run, args=(self._stopped,), name="search", daemon=True)
        self._threads = [each for each in self._threads if each.is_alive()] + [self._thread]
        self._thread.start()

    def hold(self, frame: HeldFrame) -> None:
        """Hold a frame for the search; while memory is short only some are."""
        with self._lock:
            self._place += 1
            if self._place % self._every:
                return
            self._held.append(frame)
            if len(self._held) * frame.cells.nbytes > MOST_HELD:
                self._held = deque(list(self._held)[::2])
                self._every *= 2

    def taken(self) -> Found | None:
        """The result, once; None: there is none yet. The tracker goes on with it in this very frame's successor."""
        with self._lock:
            if self._found is None:
                return None
            found, self._found, self._thread = self._found, None, None
            self._held.clear()
            return found

    def try_out(self, frames: list[FrameInput]) -> None:
        """Search in frames here and now, so that everything is compiled when it matters."""
        self._search.paths_in(frames)

    def forget(self) -> None:
        """Stop a search and drop what it held."""
        self._stopped.set()
        with self._lock:
            self._held.clear()
            self._found = self._thread = None

    def close(self) -> None:
        """Stop, and wait a little for the thread to end."""
        self.forget()
        for thread in self._threads:
            thread.join(LONGEST_END)

    def _run(self, stopped: Event) -> None:
        self._rest()
        try:
            found = self._searched(stopped)
        except _StoppedError:
            return
        except Exception as error:  # the tracker goes on without
            say(f"searching: {error if isinstance(error, InputError) else repr(error)}")
            found = Found(None)
        return_freed_memory()
        with self._lock:
            if not stopped.is_set():
                self._found = found if found is not None else Found(None)

    def _searched(self, stopped: Event) -> Found | None:
        first = self._spaced(0, stopped)
        if first is None:
            return None
        paths = self._search.paths_in(first, lambda _: _go_on(stopped))
        guesses = agreed(self._search.bodies, (0, NUM_FOLLOWED - 1), paths, lambda: self._second(stopped))
        seen = [guess for guess in guesses if all(pose.energy > 0.0 for pose in guess.poses)]
        if not seen:
            return Found(None)
        best = likeliest(seen)
        sure, shown = best.sure, f"{100.0 * best.confidence:.0f} %"
        if not sure:
            self._unsure += 1
            if self._unsure < LIKELIEST_AFTER:
                return Found(None)
        self._unsure = 0
        return self._caught_up(best, stopped, f"{'sure' if sure else 'not sure'} ({shown})")

    def _second(self, stopped: Event) -> list[Path] | None:
        """A search that is to agree with the first one, beginning with its last frame; None: it was stopped."""
        later = self._spaced(NUM_FOLLOWED - 1, stopped)
        return None if later is None else self._search.paths_in(later, lambda _: _go_on(stopped))

    def _spaced(self, skipped: int, stopped: Event) -> list[FrameInput] | None:
        """Frames of the first search's spacing in time, waited for; None: the search was stopped."""
        while not stopped.is_set():
            with self._lock:
                held = list(self._held)
            if held and held[-1].exposed - held[0].exposed >= (skipped + NUM_FOLLOWED - 1) * SECONDS:
                times = np.array([frame.exposed for frame in held])
                wanted = times[0] + SECONDS * np.arange(skipped, skipped + NUM_FOLLOWED)
                chosen = [held[int(np.abs(times - time).argmin())] for time in wanted]
                return [FrameInput(frame.cells, frame.present) for frame in chosen]
            sleep(0.02)
        return None

    def _caught_up(self, guess: Guess, stopped: Event, sentence: str) -> Found | None:
        """What was found, tracked through the held frames up to the present; None: the search was stopped."""
        moment = self.step.start(np.concatenate([np.asarray(each.pose) for each in guess.poses]))
        energy = float("-inf")
        with self._lock:
            if not self._held:  # forgotten
                return None
            done = self._held[0].exposed + (guess.frame - 0.5) * SECONDS
            behind, latest = len(self._held), 0
        while not stopped.is_set():
            with self._lock:
                before, latest = latest, max(len(self._held) - behind, 0)
                came = min(before, latest)
                while self._held and self._held[0].exposed <= done:
                    self._held.popleft()
                behind = len(self._held)
                if (behind <= max(NEARLY, came) and energy > float("-inf")) or not behind:
                    return Found(moment, sentence, done, energy)
                left_out = min(behind // HURRY + came, behind - 1)  # on a slow machine, too, it comes nearer
                frame = self._held[left_out]
            moment, tracked, _ = self.step(moment, frame.cells, frame.present, frame.exposed)
            done, energy = frame.exposed, float(tracked.result.energy)
        return None


def _go_on(stopped: Event) -> None:
    if stopped.is_set():
        raise _StoppedError
