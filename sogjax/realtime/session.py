"""A live session: cameras, slot, tracker and outlets tied together, from the first picture to the figures."""

import time
from collections.abc import Generator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sogjax.model.cores import usable_cores
from sogjax.realtime.assembler import Assembler
from sogjax.realtime.camera_threads import CameraThreads
from sogjax.realtime.figures import Figures, Stamps
from sogjax.realtime.following import Following, Solved, actor_parts
from sogjax.realtime.json_lines import Publisher
from sogjax.realtime.outlet import Outlet
from sogjax.realtime.pictures import Camera, FrameSet
from sogjax.realtime.recorder import MotionRecorder, VideoRecorder
from sogjax.realtime.replay import Pace
from sogjax.realtime.slot import Slot
from sogjax.realtime.state import ActorState, LiveState
from sogjax.run.setup import Setup
from sogjax.run.terminal import say
from sogjax.scene.cells import stack_shape

PUBLISHED_BEHIND, RECORDED_BEHIND = 4, 512
"""States that wait for publishers, and for the disk, at most."""
TOLD_EVERY = 10.0
"""Seconds from one line on the terminal to the next."""
TOO_FAST = 1.05
"""Pictures a second, as a multiple of what was said of the cameras, above which that is said to be wrong."""
SILENT = 2.0
"""Seconds without any picture after which that is said."""


@dataclass(frozen=True)
class Publishers:
    """Who is told, by name."""

    quick: dict[str, Publisher]
    """One after the other, in one thread."""
    slow: dict[str, Publisher]
    """Those that may take longer than a frame, each in a thread of its own."""


@dataclass
class Session:
    """What a live session is made of; `states` runs it.

    Its memory does not grow: all between the threads has a size, and the motion goes to the disk.
    """

    setup: Setup
    cameras: Sequence[Camera]
    following: Following
    period: float
    """Seconds from one frame to the next."""
    first: int = 0
    """The number of the first frame."""
    wait: float = 0.5
    pace: Pace | None = None
    """Of a replay, which begins when all is ready."""
    publishers: Publishers = field(default_factory=lambda: Publishers({}, {}))
    motion: MotionRecorder | None = None
    videos: VideoRecorder | None = None
    seconds: float | None = None
    """How long it takes; None: until it is stopped, or the cameras end."""
    figures: Figures = field(default_factory=Figures)

    def __post_init__(self) -> None:
        self.slot = Slot(Assembler(len(self.cameras), self.period), self._on_set)
        self._parts = actor_parts(self.setup.bodies)
        self._began: float | None = None
        self._last_exposed = 0.0
        self._frame, self._number, self._passes = self.first - 1, self.first - 1, 0
        self._given_up: frozenset[int] = frozenset()
        """As was said last."""
        self._said: dict[int, float] = {}
        self._outlets: list[Outlet[Any]] = []
        self._took, self._rate_said = 0.0, False

    @property
    def names(self) -> tuple[str, ...]:
        """The cameras."""
        return self.setup.clip.recording.rig.names

    def states(self) -> Generator[LiveState, None, None]:
        """The actors from moment to moment, until the cameras end or the iterator is closed.

        Raises:
            InputError: the cameras cannot go on.
        """
        self.slot.assembler.wait = self.wait
        recording = self.setup.clip.recording
        gains = [recording.color_gains.get(name) for name in self.names]
        with ExitStack() as stack:
            for publisher in (*self.publishers.quick.values(), *self.publishers.slow.values()):
                stack.callback(publisher.close)  # once the outlets, which end before, have passed all on
            self._outlets = [stack.enter_context(outlet) for outlet in self._made_outlets()]
            if self.following.search is not None:
                stack.callback(self.following.search.close)
            if self.videos is not None:
                stack.enter_context(self.videos)
            keeps = self.videos is not None
            stack.enter_context(CameraThreads(self.cameras, self.setup.clip.grids, self.slot, gains, keeps))
            if self.pace is not None:
                self.pace.begin()
            yield from self._solved_sets()

    def report(self) -> dict[str, Any]:
        """All figures, for `live.json`."""
        assembler, names = self.slot.assembler, self.names
        by_camera = lambda counts: {name: counts[k] for k, name in enumerate(names)}
        slowest = max(range(len(names)), key=lambda k: (assembler.missing[k], assembler.last[k]))
        dropped = {outlet.name: outlet.dropped for outlet in self._outlets}
        return self.figures.as_dict(self._took) | {
            "losses": self.following.losses,
            "searches": 0 if self.following.search is None else self.following.search.count,
            "sets": self.slot.handed_over,
            "lost": {
                "late_or_missing_pictures": by_camera(assembler.missing),
                "of_these_late": by_camera(assembler.late),
                "overwritten_sets": self.slot.overwritten,
                "unsolved_sets": self.figures.unsolved,
                "not_passed_on": dropped,
            },
            "last_to_arrive": by_camera(assembler.last),
            "slowest_camera": names[slowest],
            "replay_stood_still_seconds": 0.0 if self.pace is None else round(self.pace.slipped, 3),
            "restarts": self.following.restarts,
            "cores": usable_cores(),
        }

    def _made_outlets(self) -> list[Outlet[Any]]:
        made: list[Outlet[Any]] = [Outlet("publisher", self._publish, PUBLISHED_BEHIND)]
        made += [Outlet(name, each.send, 1) for name, each in self.publishers.slow.items()]
        if self.motion is not None:
            made.append(Outlet("motion", self.motion.take, RECORDED_BEHIND))
        return made

    def _publish(self, state: LiveState) -> None:
        for each in self.publishers.quick.values():
            each.send(state)
        self.figures.add(replace(state.stamps, sent=time.monotonic()), state.tracked_frame is not None)

    def _solved_sets(self) -> Generator[LiveState, None, None]:
        begin = told = heard = time.monotonic()
        silence_said = False
        try:
            while self.seconds is None or time.monotonic() - begin < self.seconds:
                found = self.slot.take(0.2)
                now = time.monotonic()
                if found is None:
                    if self.slot.ended:
                        break
                    if now - heard > SILENT and not silence_said:
                        say(f"no camera has given a picture for {SILENT:g} s; waiting")
                        silence_said = True
                    continue
                heard, silence_said = now, False
                state = self._solved(found, now)
                for outlet in self._outlets:
                    outlet.put(state)
                self._say_cameras()
                if now - told >= TOLD_EVERY:
                    told = now
                    say(self.figures.line(self.slot.overwritten))
                    self._say_rate(now - begin)
                yield state
        finally:
            self._took = time.monotonic() - begin

    def _solved(self, found: FrameSet, begun: float) -> LiveState:
        grids = self.setup.clip.grids
        cells, present = found.stacked(len(grids), stack_shape(grids))
        solved = self.following.follow(cells, present, found.exposed, found.number)
        frame = self._frame_of(found)
        stamps = Stamps(found.exposed, found.arrived, found.handed_over, begun, time.monotonic(), time.monotonic())
        actors = () if solved is None else self._actors(solved)
        tracked = None if solved is None else solved.tracked
        return LiveState(frame, stamps, tuple(present.tolist()), actors, tracked)

    def _actors(self, solved: Solved) -> tuple[ActorState, ...]:
        limbs, explained = solved.tracked.result.limbs, self.following.explained(solved.tracked)
        doubt = np.zeros(0) if limbs is None else np.asarray(limbs.error_probability)
        pose = np.asarray(solved.tracked.result.pose)
        return tuple(
            ActorState(body.name, solved.well, pose[dofs], solved.world_from_joint[joints], float(share), doubt)
            for (body, dofs, joints), share in zip(self._parts, explained, strict=True)
        )

    def _frame_of(self, found: FrameSet) -> int:
        """The number of a set's frame, by its time or as a replay counts, on and on: they never fall, nor stay."""
        if found.number is None:
            self._began = found.exposed if self._began is None else self._began
            frame = self.first + round((found.exposed - self._began) / self.period)
        else:
            frames = self.setup.clip.recording.frames
            self._passes += found.number < self._number
            self._number = found.number
            frame = found.number + self._passes * len(frames)
        self._frame = max(frame, self._frame + 1)
        return self._frame

    def _on_set(self, found: FrameSet) -> None:
        if self.videos is not None:
            self.videos.put(found)

    def _say_rate(self, seconds: float) -> None:
        """Tell once if cameras are faster than was said of them: their sets are then numbered too far."""
        rate = self.slot.handed_over / seconds
        if self.pace is None and not self._rate_said and rate * self.period > TOO_FAST:
            self._rate_said = True
            say(
                f"the cameras give {rate:.1f} pictures a second, not {1.0 / self.period:.4g}: the motion would be too "
                f"slow; give fps={rate:.0f}"
            )

    def _say_cameras(self) -> None:
        """Tell which cameras are not waited for any more, and which are back; of each not too often."""
        given_up, now = self.slot.assembler.given_up, time.monotonic()
        for camera in sorted(given_up ^ self._given_up):
            if now - self._said.get(camera, float("-inf")) < TOLD_EVERY:
                continue
            self._said[camera] = now
            late = self.slot.assembler.late[camera]
            why = "its pictures come too late" if late else "it gives no pictures"
            gone = f"{why}; it does not count until it is in time again"
            say(f"camera {self.names[camera]}: {gone if camera in given_up else 'is in time again'}")
            self._given_up ^= {camera}
