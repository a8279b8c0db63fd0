"""Feet that stand: when ankles and toes rest on the floor, and legs bent so that these keep their places.

The floor is level, at the height at which a foot's points are lowest. The hips stay where they are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.ndimage import binary_closing, binary_opening

from sogjax.io.export.bvh import Figure

BEGIN_SPEED, END_SPEED = 0.15, 0.3
"""Metres a second below which a point begins to rest, and above which it no longer does."""
BEGIN_HEIGHT, END_HEIGHT = 0.03, 0.05
"""Metres above where it is lowest, likewise."""
LOWEST = 5.0
"""Per cent of frames in which a point is lower than where it rests; a few are errors."""
SPEED_OVER = 0.08
"""Seconds over which speeds are taken, and for which it rests or is gone at least."""
RADIUS = 0.025
"""Metres around its place within which a point rests."""
BLEND = 0.12
"""Seconds in which a correction begins before a contact and fades after it."""
STRAIGHT = 0.995
"""Of a leg's length: farther it is not stretched to reach a place, unless it is already."""


@dataclass(frozen=True)
class _Point:
    """A point that may rest on the floor."""

    rests: Bool[np.ndarray, "frame"]
    correction: Float[np.ndarray, "frame 3"]
    """Metres from where it is to where it rests, as at the nearest contact between contacts."""
    weight: Float[np.ndarray, "frame"]
    """1 in contact, down to 0 away from it."""


def standing_feet(figure: Figure, seconds: float) -> tuple[Figure, str]:
    """The figure with feet that keep their places while they stand, and how far they slid before and after.

    The figure's legs are UpLeg, Leg, Foot and Toe of either side; `seconds` is the time from frame to frame.
    """
    corrected = replace(figure, rotations=figure.rotations.copy(), positions=figure.positions.copy())
    found: list[tuple[int, np.ndarray]] = []
    for side in ("Left", "Right"):
        leg = [figure.bones.names.index(side + name) for name in ("UpLeg", "Leg", "Foot", "Toe")]
        points = [_point(figure.positions[:, joint], seconds) for joint in leg[2:]]
        _bend(corrected, leg, *points)
        found += zip(leg[2:], (point.rests for point in points), strict=True)
    before, after = (_slide(each.positions, found) for each in (figure, corrected))
    stands = int(sum(rests.sum() for _, rests in found))
    if not stands:
        return figure, "no foot stands: legs as they were"
    return corrected, f"standing feet slid {1000 * before:.1f} mm a frame; now {1000 * after:.1f} mm"


def contacts(height: Float[np.ndarray, "frame"], speed: Float[np.ndarray, "frame"]) -> Bool[np.ndarray, "frame"]:
    """When a point rests: it begins low and slow, and goes on until it is no longer nearly so.

    Heights are metres above the floor, speeds metres a second.
    """
    begins = (height < BEGIN_HEIGHT) & (speed < BEGIN_SPEED)
    rests = np.zeros_like(begins)
    for run in _runs((height < END_HEIGHT) & (speed < END_SPEED)):
        rests[run] = begins[run].any()
    return rests


def _runs(chosen: Bool[np.ndarray, "frame"]) -> list[Int[np.ndarray, "_run"]]:
    """The numbers of frames that are chosen one after the other."""
    frames = np.flatnonzero(chosen)
    return [run for run in np.split(frames, np.flatnonzero(np.diff(frames) > 1) + 1) if len(run)]


def _point(places: Float[np.ndarray, "frame 3"], seconds: float) -> _Point:
    """Contacts of a point, and what keeps it in its place."""
    height = places[:, 1] - np.percentile(places[:, 1], LOWEST)
    shortest = max(round(SPEED_OVER / seconds), 1)
    rests = contacts(height, _speed(places, seconds))
    rests = binary_closing(np.pad(rests, shortest, mode="edge"), np.ones(shortest))[shortest:-shortest]
    rests = binary_opening(rests, np.ones(shortest))
    runs = _held(places, rests, shortest)
    correction, weight = np.zeros_like(places), np.zeros(len(places))
    for run in runs:
        correction[run] = np.median(places[run], axis=0) - places[run]
        weight[run] = 1.0
    fades = max(round(BLEND / seconds), 1)
    for last, first in _gaps(runs, len(places)):
        _fade(correction, weight, last, first, fades)
    return _Point(weight == 1.0, correction, weight)


def _held(
    places: Float[np.ndarray, "frame 3"], rests: Bool[np.ndarray, "frame"], shortest: int
) -> list[Int[np.ndarray, "_run"]]:
    """The frames of each contact, in their order: those that lie within a radius of where it mostly is.

    What is farther off, before and after, may be contacts of their own; a few frames lie between them.
    """
    held: list[np.ndarray] = []
    for run in _runs(rests):
        off = np.linalg.norm(places[run] - np.median(places[run], axis=0), axis=-1)
        far = np.flatnonzero(off > RADIUS)
        if not len(far):
            held += [run] if len(run) >= shortest else []
            continue
        middle = int(off.argmin())
        first = int(far[far < middle].max(initial=-1)) + 1
        end = int(far[far > middle].min(initial=len(run)))
        around = np.zeros_like(rests)
        around[run[: max(first - shortest, 0)]] = around[run[end + shortest :]] = True
        held += _held(places, around, shortest)
        held += [run[first:end]] if end - first >= shortest else []
    return sorted(held, key=lambda run: int(run[0]))


def _speed(places: Float[np.ndarray, "frame 3"], seconds: float) -> Float[np.ndarray, "frame"]:
    """Metres a second, over frames before and after."""
    reach = max(round(0.5 * SPEED_OVER / seconds), 1)
    frames = np.arange(len(places))
    before, after = np.maximum(frames - reach, 0), np.minimum(frames + reach, len(places) - 1)
    apart = np.linalg.norm(places[after] - places[before], axis=-1)
    return apart / (np.maximum(after - before, 1) * seconds)


def _gaps(runs: Sequence[np.ndarray], num_frames: int) -> list[tuple[int, int]]:
    """The last frame of contact before each gap and the first after it; -1 and the number of frames at the ends."""
    if not runs:
        return []
    lasts, firsts = [-1, *(int(run[-1]) for run in runs)], [*(int(run[0]) for run in runs), num_frames]
    return [(last, first) for last, first in zip(lasts, firsts, strict=True) if first - last > 1]


def _fade(correction: np.ndarray, weight: np.ndarray, last: int, first: int, fades: int) -> None:
    """Fill the frames between two contacts: each half holds the nearest one's correction, with a weight that fades."""
    inside = np.arange(last + 1, first)
    middle = (last + first) / 2.0 if last >= 0 and first < len(weight) else (-1.0 if last < 0 else float(first))
    for frame in inside:
        edge = last if frame < middle else first
        reach = min(fades, abs(middle - edge)) if 0 <= middle < len(weight) else fades
        near = np.clip(1.0 - abs(frame - edge) / max(reach, 1.0), 0.0, 1.0)
        correction[frame] = correction[edge]
        weight[frame] = near * near * (3.0 - 2.0 * near)


def _bend(figure: Figure, leg: Sequence[int], ankle: _Point, toe: _Point) -> None:
    """Turn a leg's bones so that ankle and toe are where they rest; between contacts the foot follows as a whole."""
    hip, knee, foot, tip = leg
    places, turns = figure.positions, figure.rotations
    weights = [point.weight[:, None] for point in (ankle, toe)]
    moves = [point.correction * weight for point, weight in zip((ankle, toe), weights, strict=True)]
    new_ankle = places[:, foot] + moves[0] + (1.0 - weights[0]) * moves[1]
    new_toe = places[:, tip] + moves[1] + (1.0 - weights[1]) * moves[0]
    lengths = tuple(
        float(np.linalg.norm(places[0, b] - places[0, a])) for a, b in ((hip, knee), (knee, foot), (foot, tip))
    )
    far = new_ankle - places[:, hip]
    reach = np.linalg.norm(places[:, foot] - places[:, hip], axis=-1)
    reach = np.maximum(reach, STRAIGHT * (lengths[0] + lengths[1])) / np.linalg.norm(far, axis=-1)
    new_ankle = places[:, hip] + np.minimum(reach, 1.0)[:, None] * far
    turned = shortest_turns(places[:, tip] - places[:, foot], new_toe - new_ankle)
    near = places[:, knee] + turns[:, hip, :, 1]  # a knee bends to the front of its thigh
    moved = np.linalg.norm(moves[0], axis=-1) + np.linalg.norm(moves[1], axis=-1) > 0
    meet = np.where(
        moved[:, None], middle_joint(places[:, hip], near, new_ankle, (lengths[0], lengths[1])), places[:, knee]
    )
    shank = new_ankle - meet
    shank = lengths[1] * shank / np.linalg.norm(shank, axis=-1, keepdims=True)
    for joint, old, new in (
        (hip, places[:, knee] - places[:, hip], meet - places[:, hip]),
        (knee, places[:, foot] - places[:, knee], shank),
    ):
        turns[:, joint] = shortest_turns(old, new) @ turns[:, joint]
    to_toe = np.einsum("tij,tj->ti", turned, places[:, tip] - places[:, foot])
    for joint in (foot, tip):
        turns[:, joint] = turned @ turns[:, joint]
    places[:, knee], places[:, foot] = meet, meet + shank
    places[:, tip] = places[:, foot] + to_toe


def _slide(
    places: Float[np.ndarray, "frame bone 3"], resting: Sequence[tuple[int, Bool[np.ndarray, "frame"]]]
) -> float:
    """Metres from frame to frame that points move while they rest, on average."""
    steps = [
        np.linalg.norm(np.diff(places[:, joint], axis=0), axis=-1)[rests[1:] & rests[:-1]] for joint, rests in resting
    ]
    together = np.concatenate(steps)
    return float(together.mean()) if len(together) else 0.0


Vectors = Float[np.ndarray, "frame 3"]


def middle_joint(start: Vectors, near: Vectors, end: Vectors, lengths: tuple[float, float]) -> Vectors:
    """The place that is `lengths` away from `start` and `end`, on the side of `near`.

    Where the ends are too far apart it is on the line between them, and the second bone does not reach.
    """
    upper, lower = lengths
    along = end - start
    apart = np.maximum(np.linalg.norm(along, axis=-1, keepdims=True), 1e-9)
    along = along / apart
    forward = np.clip((upper**2 - lower**2 + apart**2) / (2.0 * apart), -upper, upper)
    aside = near - start
    aside = aside - (aside * along).sum(axis=-1, keepdims=True) * along
    aside = aside / np.maximum(np.linalg.norm(aside, axis=-1, keepdims=True), 1e-9)
    return start + forward * along + np.sqrt(np.maximum(upper**2 - forward**2, 0.0)) * aside


def shortest_turns(before: Vectors, after: Vectors) -> Float[np.ndarray, "frame 3 3"]:
    """The smallest rotations that turn one direction to the other; for opposite ones none."""
    one, other = (each / np.maximum(np.linalg.norm(each, axis=-1, keepdims=True), 1e-9) for each in (before, after))
    axis, cosine = np.cross(one, other), (one * other).sum(axis=-1)
    crossed = np.zeros((len(axis), 3, 3))
    crossed[:, [2, 0, 1], [1, 2, 0]] = axis
    crossed -= crossed.swapaxes(-1, -2)
    safe = np.maximum(1.0 + cosine, 1e-9)
    return np.eye(3) + crossed + crossed @ crossed / safe[:, None, None]
