"""Which cameras stand elsewhere, or see at another time, than is said of them.

The poses, and with them the shape, take part in every answer (they are eliminated from the quadratic model of the
clip), so that a camera is judged by what the others say.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sogjax.refine.camera_moves import MOVE, PLACE, TIME, TURN

PARTS = {"turn": TURN, "place": PLACE, "time": TIME}
CLEARLY = {"turn": 0.25, "place": 0.25, "time": 0.08}
"""Share of what a camera could gain at most, which a move must gain to be believed. What the body does not explain
looks like a move, too."""
KEPT = 0.6
"""Part of that share which is enough to stay believed: the model of a move expects more than there is."""
TOGETHER = 0.3
"""Part of the largest gain that others must have to be taken in the same round: a fault of one looks like smaller ones
of its neighbours, opposite."""
RIVAL, EXPLAINED = 0.8, 0.5
"""A fault is not believed if another camera's gains so large a part of what it gains, and loses so much of that once
the first is mended: either may be wrong then. Of four cameras those that face each other see alike."""
FEWEST_AGREEING = {"turn": 3, "place": 3, "time": 1}
"""Cameras that hold the world: at least so many stay as they are."""


@dataclass(frozen=True)
class Part:
    """One thing that may be wrong with one camera."""

    camera: int
    name: str
    """One of `PARTS`."""

    @property
    def columns(self) -> slice:
        """Where it stands among the moves of all cameras."""
        part = PARTS[self.name]
        return slice(MOVE * self.camera + part.start, MOVE * self.camera + part.stop)


@dataclass(frozen=True)
class CamerasModel:
    """What the moves of all cameras are worth, everything else following them (and 0 = the moves as they are)."""

    gradient: Float[np.ndarray, "move"]
    curvature: Float[np.ndarray, "move move"]
    moves: Float[np.ndarray, "move"]
    """The moves as they are."""
    most: Float[np.ndarray, "camera"]
    """What each camera would gain if every blob could move freely in its picture."""

    def newly_told(self, free: list[Part], candidates: list[Part], undone: Sequence[Part] = ()) -> list[Part]:
        """Candidates whose moves gain clearly, the best first; those that are free already move with them.

        `undone` were believed before, and turned out not to be worth it.
        """
        found: list[Part] = []
        undecided: list[Part] = []
        first = 0.0
        while True:
            left = [part for part in candidates if part not in free + found + undecided]
            left = [part for part in left if self._may_move(part, free + found, free)]
            gains = {part: self._gain(part, free + found) for part in left}
            clear = {part: gain for part, gain in gains.items() if gain > CLEARLY[part.name] * self.most[part.camera]}
            best = max(clear, key=lambda part: clear[part], default=None)
            if best is None or clear[best] < TOGETHER * first:
                return found
            rivals = self._rivals(best, gains, free + found, undone)
            if rivals:
                undecided += [best, *rivals]
                continue
            first = max(first, clear[best])
            found.append(best)

    def shares(self, free: list[Part]) -> dict[Part, float]:
        """What each free move is worth now, as a share of what its camera could gain at most without it."""
        found = {}
        for part in free:
            others = [other for other in free if other != part]
            _, curvature = self._alone(part, others)
            move = self.moves[part.columns]
            worth = 0.5 * float(move @ curvature @ move)
            found[part] = worth / (worth + self.most[part.camera])
        return found

    def doubtful(self, free: list[Part]) -> list[Part]:
        """Free moves that are not worth it."""
        return [part for part, share in self.shares(free).items() if share < KEPT * CLEARLY[part.name]]

    def _may_move(self, part: Part, free: list[Part], known: list[Part]) -> bool:
        """Somebody seen from afar hardly tells a camera that moved from one that turned: turns come first."""
        moved = {other.camera for other in free if other.name == part.name}
        if part.name == "place" and Part(part.camera, "turn") not in known:
            return False
        return len(self.most) - len(moved) > FEWEST_AGREEING[part.name]

    def _rivals(self, best: Part, gains: dict[Part, float], free: list[Part], undone: Sequence[Part]) -> list[Part]:
        """The parts of other cameras that explain it as well; what was undone before rivals with less."""
        tried = {part: self._gain(part, free) for part in undone if part.name == best.name}
        if any(gain > EXPLAINED * gains[best] for gain in tried.values()):
            return list(tried)
        alike = [
            part for part in gains if part.name == best.name and part != best and gains[part] > RIVAL * gains[best]
        ]
        return [part for part in alike if self._gain(part, [*free, best]) < EXPLAINED * gains[part]]

    def _gain(self, part: Part, free: list[Part]) -> float:
        gradient, curvature = self._alone(part, free)
        return 0.5 * float(gradient @ np.linalg.solve(curvature, gradient))

    def _alone(
        self, part: Part, others: list[Part]
    ) -> tuple[Float[np.ndarray, "number"], Float[np.ndarray, "number number"]]:
        """Gradient and curvature by one part, others following it."""
        own, rest = np.r_[part.columns], _columns(others)
        curvature = self.curvature[np.ix_(own, own)]
        gradient = self.gradient[own]
        if len(rest):
            cross = np.linalg.solve(self.curvature[np.ix_(rest, rest)], self.curvature[np.ix_(rest, own)])
            curvature = curvature - self.curvature[np.ix_(own, rest)] @ cross
            gradient = gradient - cross.T @ self.gradient[rest]
        return gradient, curvature


def free_moves(parts: list[Part], num_cameras: int) -> Bool[np.ndarray, "move"]:
    """Which numbers of the cameras' moves may change."""
    free = np.zeros(MOVE * num_cameras, bool)
    free[_columns(parts)] = True
    return free


def _columns(parts: list[Part]) -> np.ndarray:
    return np.concatenate([np.r_[part.columns] for part in parts]) if parts else np.zeros(0, int)
