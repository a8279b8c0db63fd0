"""Adjusting cameras: which stand elsewhere, or see at another time, than is said of them.

Moves that gain clearly are freed, the clip is climbed again, and what then does not is undone. The poses, and with them
the shape, take part in every answer (they are eliminated from the quadratic model of the clip), so that a camera is
judged by what the others say.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from sogjax.refine.camera_moves import MOVE, PLACE, TIME, TURN
from sogjax.refine.climb import LEAST_DAMPING, Climbed, climbed
from sogjax.refine.clip_energy import ClipEnergy

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


ROUNDS = 6
"""Rounds of freeing and undoing, at most."""


@dataclass(frozen=True)
class FoundCameras:
    """Where cameras are, and when."""

    climbed: Climbed
    """What was climbed, with the cameras' moves behind the shape parameters."""
    moves: Float[np.ndarray, "camera 7"]
    shares: dict[Part, float]
    """What is believed, and what each is worth as a share of what its camera could gain at most."""


def found_cameras(
    energy: ClipEnergy,
    poses: Float[np.ndarray, "frame dof"],
    params: Float[np.ndarray, "shared"],
    with_shape: bool,
    names: tuple[str, ...],
    report: Callable[[str], None] = lambda _: None,
) -> FoundCameras | None:
    """Moves of cameras that explain the clip clearly better; None: there are none.

    `poses` and `params` (shape, then moves) are those of highest energy with the cameras as they are; `names` are the
    parts of a move that are in question (turn, place, time). After each round `report` is told what is free.
    """
    shape = energy.shape.num_params
    cameras = (energy.num_shared - shape) // MOVE
    of_shape = np.full(shape, with_shape)
    start, found = (poses, params), None
    in_question = [Part(camera, name) for camera in range(cameras) for name in names]
    free: list[Part] = []
    undone: list[Part] = []
    for _ in range(ROUNDS):
        energy = energy.near(poses, params)
        model = cameras_model(energy, poses, params, of_shape)
        doubtful = model.doubtful(free)
        more = [] if doubtful else model.newly_told(free, in_question, undone)
        if not doubtful and not more:
            break
        undone += doubtful
        in_question = [part for part in in_question if part not in doubtful]
        free = [part for part in free if part not in doubtful] + more
        params = _undone(params, start[1], doubtful, shape)
        found = climbed(energy, poses, params, np.concatenate([of_shape, free_moves(free, cameras)]), tracked=start)
        poses, params = found.poses, found.params
        report(", ".join(f"{part.name} of camera {part.camera + 1}" for part in free) or "none")
    if found is None or not free:
        return None
    shares = cameras_model(energy.near(poses, params), poses, params, of_shape).shares(free)
    return FoundCameras(found, energy.moves(params), shares)


def cameras_model(
    energy: ClipEnergy,
    poses: Float[np.ndarray, "frame dof"],
    params: Float[np.ndarray, "shared"],
    of_shape: Bool[np.ndarray, "shape"],
) -> CamerasModel:
    """What the moves of the cameras are worth when the poses, and the shape where it may change, follow them."""
    _, system, (scale, _) = energy.model(poses, params)
    gradient, curvature = system.of_shared(LEAST_DAMPING * (scale + scale.mean(axis=1, keepdims=True)))
    shape = np.flatnonzero(of_shape)
    count = len(of_shape)
    own, across = curvature[count:, count:], curvature[np.ix_(shape, np.arange(count, len(curvature)))]
    along = np.linalg.solve(curvature[np.ix_(shape, shape)], np.column_stack([gradient[shape], across]))
    return CamerasModel(
        gradient[count:] - across.T @ along[:, 0],
        own - across.T @ along[:, 1:],
        params[count:],
        energy.most(poses, params),
    )


def _undone(
    params: Float[np.ndarray, "shared"], start: Float[np.ndarray, "shared"], parts: list[Part], shape: int
) -> Float[np.ndarray, "shared"]:
    """The parameters with some moves as they were at the start."""
    back = np.concatenate([np.zeros(shape, bool), free_moves(parts, (len(params) - shape) // MOVE)])
    return np.where(back, start, params)
