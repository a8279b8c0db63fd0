"""Who is who, among people that are seen apart in several frames: by their places, and by their colours."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from scipy.optimize import linear_sum_assignment

from sogjax.actor.people_apart import PersonSeen

FASTEST = 4.0
"""Metres per second: people who stand farther apart than this brings one until the next frame cannot change places."""
MOVED = 0.5
"""Largest way from frame to frame, as a share of the distance between two people, for places to tell them."""
SURE = 0.2
"""Least difference that exchanging two people makes to how far their colours are off (from 0 to 2), to tell them."""

Moment = Sequence[PersonSeen]
"""The people in one frame, as many in each."""


def told_apart(moments: Sequence[Moment], fps: float) -> list[list[PersonSeen]]:
    """The moments (in the order of the clip) in which it is sure who is who, people in the same order in all of them.

    Within a run of moments, places tell; runs are brought together by the colours, the longest first.
    """
    runs = runs_by_place(moments, fps)
    if not runs:
        return []
    told: list[list[PersonSeen]] = []
    for run in sorted(runs, key=len, reverse=True):
        colors = [_mean_colors(run, k) for k in range(len(run[0]))]
        order = list(range(len(colors)))
        if told:
            known = [_mean_colors(told, k) for k in order]
            order, margin = matched(np.array([[unlike(a, b) for b in colors] for a in known]))
            if margin < SURE:
                continue
        told += [[moment[k] for k in order] for moment in run]
    return sorted(told, key=lambda moment: moment[0].frame)


def runs_by_place(moments: Sequence[Moment], fps: float) -> list[list[list[PersonSeen]]]:
    """Moments that follow each other so fast that nobody can have changed places, people in one order in each run."""
    runs: list[list[list[PersonSeen]]] = []
    for moment in moments:
        last = runs[-1][-1] if runs else None
        ways = None if last is None else _distances(last, moment)
        if last is not None and ways is not None:
            order, _ = matched(ways)
            apart = min(_nearest(last), _nearest(moment))
            moved = max(float(ways[k, other]) for k, other in enumerate(order))
            seconds = (moment[0].frame - last[0].frame) / fps
            if moved < MOVED * apart and FASTEST * seconds < apart:
                runs[-1].append([moment[k] for k in order])
                continue
        runs.append([list(moment)])
    return runs


def matched(costs: Float[np.ndarray, "known found"]) -> tuple[list[int], float]:
    """Which one found is each one known, at the least cost, and what exchanging two of them would cost more."""
    order = linear_sum_assignment(costs)[1].tolist()
    pairs = [(i, j) for i in range(len(order)) for j in range(i)]
    exchanged = [costs[i, order[j]] + costs[j, order[i]] - costs[i, order[i]] - costs[j, order[j]] for i, j in pairs]
    return order, float(min(exchanged, default=np.inf))


def unlike(one: Float[np.ndarray, "bin"], other: Float[np.ndarray, "bin"]) -> float:
    """From 0 to 1: how little two histograms of colours have in common."""
    return 1.0 - float(np.minimum(one, other).sum())


def _mean_colors(moments: Sequence[Moment], person: int) -> Float[np.ndarray, "bin"]:
    return np.mean([moment[person].colors for moment in moments], axis=0)


def _distances(one: Moment, other: Moment) -> Float[np.ndarray, "one other"]:
    return np.array([[np.linalg.norm(a.place - b.place) for b in other] for a in one])


def _nearest(moment: Moment) -> float:
    """The distance of the two that are nearest to each other, metres."""
    distances = _distances(moment, moment)
    return float(np.min(distances[~np.eye(len(moment), dtype=bool)], initial=np.inf))
