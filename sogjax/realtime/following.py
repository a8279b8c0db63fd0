"""Following the actors from set to set: tracked, lost, searched for beside, found again."""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.model.body import Body, dof_slices
from sogjax.model.limbs import limb_names
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.verdict import expected_of
from sogjax.realtime.searching import Found, HeldFrame, SearchBeside
from sogjax.realtime.stepping import LiveStep, Moment
from sogjax.run.terminal import say
from sogjax.tracking.frame import TrackedFrame

DOUBTED_AFTER = 0.6
"""Seconds for which too little of an actor must be explained before it is searched for beside the tracker."""
GONE_AFTER = 1.0
"""Seconds for which hardly anything must be explained before nobody is in view."""
GONE = 0.3
"""Part of what is expected to be explained below which nobody is there."""
LOST_LIMB = 0.7
"""How likely a limb must be more than 10 cm off for a search."""
SLOW = 2.0
"""Periods from one frame to the next from which on limbs are not searched for beside the tracker."""
BETTER = 0.002
"""Share by which what a search found must explain a frame better than what is tracked."""
ENERGIES = 64
"""Frames whose energies are kept, to be compared with."""
REST, LONGEST_REST, LONGEST_WITHOUT = 2.0, 30.0, 4.0
"""Seconds after a search that was in vain, doubled each time up to the second, or while nobody is tracked to the third:
who enters must not wait."""


@dataclass(frozen=True)
class Solved:
    """What was found in one set."""

    tracked: TrackedFrame
    world_from_joint: Float[np.ndarray, "joint 4 4"]
    well: bool
    """Whether as much as is to be expected is explained."""


@dataclass
class Following:
    """The actors while sets come; times are seconds.

    Args:
        step: the tracker's step.
        bodies: the actors, as they stand in the world.
        search: runs beside; None: nothing is searched for.
        start: the pose with which a replay begins, where it is known.
        period: of the cameras; None: not known.
    """

    step: LiveStep
    bodies: Sequence[Body]
    search: SearchBeside | None = None
    start: Float[np.ndarray, "dof"] | None = None
    period: float | None = None
    losses: int = 0
    restarts: int = 0
    report: Callable[[str], object] = field(default=say)

    def __post_init__(self) -> None:
        self._moment: Moment | None = None if self.start is None else self.step.start(self.start)
        self._energies: deque[tuple[float, float]] = deque(maxlen=ENERGIES)
        self._limbs = [name for body in self.bodies for name in limb_names(body)]
        self._exposed: float | None = None
        self._interval = 0.0
        self._bad_since: float | None = None
        self._gone_since: float | None = None
        self._rest, self._not_before = REST, float("-inf")
        self._number, self._nobody_said, self._lost = -1, False, False
        expected = expected_of(self.bodies)
        bounds = fitted_numbers().verdict
        of = lambda body: (
            bounds.other_subject * expected[body.name] if body.name in expected else bounds.least_explained
        )
        self._least = np.array([of(body) for body in self.bodies])

    def follow(
        self,
        cells: UInt8[np.ndarray, "camera rows columns 3"],
        present: Bool[np.ndarray, "camera"],
        exposed: float,
        number: int | None = None,
    ) -> Solved | None:
        """Find the actors in a set; None: nobody is tracked.

        `number` is the frame of a replay, which begins again where it falls.
        """
        if number is not None and number < self._number:
            self._begin_again()
        self._number = -1 if number is None else number
        self._interval += 0.1 * (exposed - (self._exposed or exposed) - self._interval)
        self._exposed = exposed
        if self.search is not None and self.search.busy:
            self.search.hold(HeldFrame(cells, present, exposed))
            self._take_over(self.search.taken(), exposed)
        if self._moment is None:
            self._ask(exposed, "nobody is in view: searching beside" if not self._nobody_said else None)
            self._nobody_said = True
            return None
        self._moment, tracked, joints = self.step(self._moment, cells, present, exposed)
        self._energies.append((exposed, float(tracked.result.energy)))
        well = self._judge(tracked, exposed)
        return None if self._moment is None else Solved(tracked, joints, well)

    def explained(self, tracked: TrackedFrame) -> Float[np.ndarray, "actor"]:
        """The part of each actor that is explained."""
        limbs = tracked.result.limbs
        if limbs is None or limbs.explained is None:
            return np.ones(len(self.bodies))
        return np.asarray(limbs.explained, float)

    def _judge(self, tracked: TrackedFrame, now: float) -> bool:
        """Whether the actors are still there; starts a search where they, or limbs of theirs, are not."""
        explained = self.explained(tracked)
        well, gone = bool((explained >= self._least).all()), bool((explained < GONE * self._least).all())
        lost = self._lost_limb(tracked)
        since = lambda holds, before: None if not holds else now if before is None else before
        self._bad_since = since(not well or lost is not None, self._bad_since)
        self._gone_since = since(gone, self._gone_since)
        if self._bad_since is None:
            self._rest, self._lost = REST, False
        if self._gone_since is not None and now - self._gone_since > GONE_AFTER:
            self._note_loss()
            self._moment, self._bad_since, self._gone_since, self._nobody_said = None, None, None, False
            self._not_before = now
        elif self._bad_since is not None and now - self._bad_since > DOUBTED_AFTER and not self._is_slow:
            named = zip(self.bodies, explained.tolist(), strict=True)
            shares = ", ".join(f"{body.name} {share:.0%}" for body, share in named)
            doubt = f"{lost} is in doubt" if well else f"too little is explained ({shares}), as of somebody else"
            if self._ask(now, f"{doubt}: searching beside"):
                self._note_loss()
        return well

    @property
    def _is_slow(self) -> bool:
        """Whether the machine holds so few frames that a search would only take more of them away."""
        return self.period is not None and self._interval > SLOW * self.period

    def _lost_limb(self, tracked: TrackedFrame) -> str | None:
        """The limb that is most likely lost; None: none is."""
        limbs = tracked.result.limbs
        doubt = np.zeros(0) if limbs is None else np.asarray(limbs.error_probability)
        return self._limbs[int(doubt.argmax())] if len(doubt) and doubt.max() >= LOST_LIMB else None

    def _note_loss(self) -> None:
        self.losses += not self._lost
        self._lost = True

    def _ask(self, now: float, said: str | None) -> bool:
        """Begin a search, unless one runs, or the last one was in vain a moment ago."""
        if self.search is None or self.search.busy or now < self._not_before:
            return False
        if said is not None:
            self.report(said)
        self.search.begin()
        return True

    def _take_over(self, found: Found | None, now: float) -> None:
        """Go on with what a search found, if it explains its last frame better than what is tracked."""
        if found is None:
            return
        longest = LONGEST_REST if self._moment is not None else LONGEST_WITHOUT
        self._not_before, self._rest = now + min(self._rest, longest), min(2.0 * self._rest, LONGEST_REST)
        before = next((energy for exposed, energy in self._energies if exposed == found.exposed), float("-inf"))
        if found.moment is None or (self._moment is not None and found.energy < before + BETTER * abs(before)):
            return
        self._moment, self._bad_since, self._gone_since, self._nobody_said = found.moment, None, None, False
        self.report(f"found {', '.join(body.name for body in self.bodies)}: {found.sentence}")

    def _begin_again(self) -> None:
        """A replay has come to its end: nobody walked from there to its beginning."""
        self.restarts += 1
        if self.search is not None:
            self.search.forget()
        self._bad_since = self._gone_since = None
        self._energies.clear()
        self._moment = None if self.start is None else self.step.start(self.start)


def actor_parts(bodies: Sequence[Body]) -> list[tuple[Body, slice, slice]]:
    """Each actor with its degrees of freedom and its joints in the pose and joints of all."""
    parts, first = [], 0
    for body, dofs in zip(bodies, dof_slices(bodies), strict=True):
        stop = first + body.skeleton.num_joints
        parts.append((body, dofs, slice(first, stop)))
        first = stop
    return parts
