"""The poses of all actors in one frame without a hint, found alone and judged together, followed into later frames."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from sogjax.search.cell_evidence import cell_evidence
from sogjax.search.combination import Combination, Optima, best_combination, in_one_place
from sogjax.search.found_pose import Followed, Path, judged
from sogjax.search.placed_body import centres_of, uprightness
from sogjax.search.pose_search import (
    NUM_LAST,
    Hypotheses,
    PlacedSearch,
    PoseSearch,
    Report,
    Told,
    different,
    search,
    unreported,
    untold,
    with_better_limbs,
    with_look_alikes,
)
from sogjax.search.seen_frame import SeenFrame

FrameMaker = Callable[[PoseSearch, int], SeenFrame]
"""A frame as it is compared with one body: that which is searched (0) and those that come next."""

ITERATIONS = 8
"""Steps by which a hypothesis is climbed in each frame that it is followed into."""
SWEEPS = 2
"""Times that several actors are climbed in turn in the frame that is searched, each given the others."""
SAME_WINDOW = 0.5
"""Metres between the middles of hypotheses that are looked at in the same windows, so that they can be compared."""
SEARCHING = 0.7
"""Part of the work that is searching; the rest is weighing and following."""
LEFT_OVER = 0.5
"""Part of what the best of an actor's optima is worth alone: one who keeps less beside the others is searched again."""
UPSIDE_DOWN = 0.1
"""What being upside down costs, as a part of the likelihood that a body gains by being seen for each of its cells: few
people are, and shadows on the floor look like arms that are held up."""

Poses = Float[np.ndarray, "hypothesis dof"]


def search_poses(
    searchers: Sequence[PoseSearch],
    make: FrameMaker,
    num_frames: int,
    report: Report = unreported,
    told: Told = untold,
) -> list[Path]:
    """The poses of some actors in one frame, which explain the later ones too, in the order of the actors.

    Each is searched for alone; of their optima those are taken that explain most together. An actor for whom little is
    left beside the others is searched for once more, where they are not.
    """
    frames = [[make(searcher, number) for number in range(num_frames)] for searcher in searchers]
    optima, of_each = [], SEARCHING / len(searchers)
    for k, searcher in enumerate(searchers):
        of_search = lambda share, k=k: report(of_each * (k + share))
        optima.append(_searched(searcher, frames[k][0], of_search, untold if k else told))
    paths = [Path.of_nothing(searcher.body, num_frames) for searcher in searchers]
    seen = [k for k in range(len(searchers)) if len(optima[k])]
    if seen:
        actors = [Sought(searchers[k], frames[k], optima[k]) for k in seen]
        for k, path in zip(seen, _paths_together(actors), strict=True):
            paths[k] = path
    report(1.0)
    return paths


@dataclass(frozen=True)
class Sought:
    """One actor, the frames as they are compared with it, and its different optima in the first of them."""

    searcher: PoseSearch
    frames: Sequence[SeenFrame]
    poses: Poses

    def given(self, number: int, others: "Sequence[tuple[Sought, Float[np.ndarray, 'dof']]]") -> SeenFrame:
        """A frame with other actors found in poses."""
        frame = self.frames[number]
        for other, pose in others:
            frame = frame.with_found(other.searcher.body, pose)
        return frame

    def scored(self, frame: SeenFrame) -> Float[np.ndarray, "hypothesis"]:
        """How likely its optima are in a frame, as energies."""
        placed, tried = _placed(self.searcher, frame, self.poses)
        return self.likely(placed.scored(tried)).values

    def likely(self, tried: Hypotheses) -> Hypotheses:
        """Hypotheses with their energies less what being upside down costs."""
        downwards = np.maximum(-uprightness(self.searcher.body, tried.poses, self.searcher.up), 0.0)
        return replace(tried, values=tried.values - UPSIDE_DOWN * downwards)


def _searched(searcher: PoseSearch, frame: SeenFrame, report: Report = unreported, told: Told = untold) -> Poses:
    found = search(searcher, frame, report=report, told=told)
    return np.stack([optimum.pose for optimum in found]) if found else np.zeros((0, searcher.body.skeleton.num_dofs))


def _paths_together(actors: list[Sought]) -> list[Path]:
    """The best of the optima that go together, followed."""
    combined = best_combination(_weighed(actors))
    poorest = int(np.argmin(combined.shares))
    if len(actors) > 1 and (not combined.apart or combined.shares[poorest] < LEFT_OVER):
        actors[poorest] = _searched_again(actors, poorest, combined)
        combined = best_combination(_weighed(actors))
    if len(actors) > 1:
        at = [actor.poses[row] for actor, row in zip(actors, combined.chosen, strict=True)]
        actors = [_beside_others(actors, k, at) for k in range(len(actors))]
    followed, best = _followed(actors, [0] * len(actors) if len(actors) > 1 else combined.chosen)
    first = [paths.poses[0, row] for paths, row in zip(followed, best, strict=True)]

    def judge(k: int) -> Path:
        actor, pose = actors[k], first[k]
        frame = actor.given(0, [(actors[j], first[j]) for j in range(len(actors)) if j != k])
        seen = cell_evidence(actor.searcher, frame, pose)
        searcher, behind, left = actor.searcher, combined.exchange[k], combined.shares[k]
        return judged(searcher.body, followed[k], best[k], seen, behind, left, searcher.up)

    return [judge(k) for k in range(len(actors))]


def _weighed(actors: Sequence[Sought]) -> list[Optima]:
    """What each optimum is worth alone and given those of the others."""

    def weigh(k: int) -> Optima:
        actor, others = actors[k], [j for j in range(len(actors)) if j != k]
        body = actor.searcher.body
        given = {
            j: np.stack([actor.scored(actor.given(0, [(actors[j], pose)])) for pose in actors[j].poses], axis=1)
            for j in others
        }
        inside = {j: in_one_place(body, actor.poses, actors[j].searcher.body, actors[j].poses) for j in others}
        return Optima(actor.scored(actor.frames[0]), given, inside)

    return [weigh(k) for k in range(len(actors))]


def _searched_again(actors: Sequence[Sought], k: int, combined: Combination) -> Sought:
    """An actor with its optima where the others are not, and with the one that it had."""
    actor = actors[k]
    others = [(other, other.poses[row]) for other, row in zip(actors, combined.chosen, strict=True)]
    frame = actor.given(0, [each for j, each in enumerate(others) if j != k])
    poses = np.concatenate([actor.poses[combined.chosen[k]][None], _searched(actor.searcher, frame)])
    values = Sought(actor.searcher, actor.frames, poses[: NUM_LAST + 1]).scored(frame)
    return Sought(
        actor.searcher, actor.frames, poses[different(actor.searcher.body, poses, values, NUM_LAST)].astype(np.float32)
    )


def _beside_others(actors: Sequence[Sought], k: int, at: Sequence[Float[np.ndarray, "dof"]]) -> Sought:
    """An actor as it fits best beside the others first, then with other limbs and turned, then its other optima.

    Alone, a limb is often held where another actor's limb is seen.
    """
    actor, others = actors[k], [(other, at[j]) for j, other in enumerate(actors) if j != k]
    placed, tried = _placed(actor.searcher, actor.given(0, others), at[k][None])
    held = actor.likely(with_look_alikes(placed, with_better_limbs(placed, tried)))
    poses = np.concatenate([held.poses, actor.poses]).astype(np.float32)
    values = np.concatenate([held.values, actor.scored(actor.given(0, others))])
    values[np.argmax(held.values)] = values.max() + 1.0  # first, whatever those in another place are worth
    return Sought(actor.searcher, actor.frames, poses[different(actor.searcher.body, poses, values, NUM_LAST)])


def _followed(actors: Sequence[Sought], chosen: Sequence[int]) -> tuple[list[Followed], list[int]]:
    """The optima of all actors climbed in the frame that they were found in, and from there in those that come next.

    Each is climbed beside the best poses of the others. Also the best of each in the first of the frames.
    """
    best, poses = list(chosen), [[actor.poses] for actor in actors]
    energies: list[list[np.ndarray]] = [[] for _ in actors]
    for number in range(len(actors[0].frames)):
        expected = [each[-1] if len(each) < 3 else 2.0 * each[-1] - each[-2] for each in poses]
        expected = [each.astype(np.float32) for each in expected]
        climbed: list[Hypotheses] = []
        for _ in range(SWEEPS if number == 0 and len(actors) > 1 else 1):
            at = [each[row] for each, row in zip(expected, best, strict=True)]
            climbed = [_climbed_beside(actors, k, number, tried, at) for k, tried in enumerate(expected)]
            expected = [each.poses for each in climbed]
            if number == 0:
                best = [_best_beside(actors, k, climbed[k], at) for k in range(len(actors))]
        for k, each in enumerate(climbed):
            poses[k].append(each.poses)
            energies[k].append(each.values)
    return [Followed(np.stack(p[1:]), np.stack(e)) for p, e in zip(poses, energies, strict=True)], best


def _climbed_beside(
    actors: Sequence[Sought], k: int, number: int, poses: Poses, at: Sequence[Float[np.ndarray, "dof"]]
) -> Hypotheses:
    """Hypotheses of one actor climbed in a frame in which the others are in some poses."""
    others = [(other, pose) for j, (other, pose) in enumerate(zip(actors, at, strict=True)) if j != k]
    placed, tried = _placed(actors[k].searcher, actors[k].given(number, others), poses)
    return actors[k].likely(placed.climbed(tried, ITERATIONS))


def _best_beside(actors: Sequence[Sought], k: int, climbed: Hypotheses, at: Sequence[Float[np.ndarray, "dof"]]) -> int:
    """The best that is not in another one's place; the best of all, if all are."""
    body, inside = actors[k].searcher.body, np.zeros(len(climbed.poses), bool)
    for j, other in enumerate(actors):
        if j != k:
            inside |= in_one_place(body, climbed.poses, other.searcher.body, at[j][None])[:, 0]
    return int(np.argmax(climbed.values if inside.all() else np.where(inside, -np.inf, climbed.values)))


def _placed(searcher: PoseSearch, frame: SeenFrame, poses: Poses) -> tuple[PlacedSearch, Hypotheses]:
    """A search around hypotheses, those near each other in the same windows."""
    centres = centres_of(searcher.body, poses)
    first = [int(np.argmax(np.linalg.norm(centres - centre, axis=1) < SAME_WINDOW)) for centre in centres]
    places, where = np.unique(first, return_inverse=True)
    middles = np.stack([centres[np.array(first) == place].mean(axis=0) for place in places])
    return PlacedSearch.of_places(searcher, frame, middles), Hypotheses(poses, where, np.zeros(len(poses)))
