"""Both ways: where limbs are in doubt, a clip is tracked backwards, too, and each limb is taken from the better pass.

A limb that is lost is often found again by itself. Backwards from there it is followed into the frames where it was
lost: what hid it, or moved too far for one frame, comes from the other side.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.model.body import Body
from sogjax.tracking.body_parts import Part, body_parts
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameCells, TrackState, on_device
from sogjax.tracking.limb_doubt import Judgement
from sogjax.tracking.mirrored import fitted_to_blobs
from sogjax.tracking.tracker import Tracker, track

DOUBTFUL = 0.3
"""A limb that is doubted more makes its frame one that is tracked backwards."""
SURE_FRAMES = 3
"""Frames without doubt that lie between two stretches, at least."""
APART, TOGETHER = 0.05, 0.02
"""Metres, mean over the blobs of a part: from where on the two passes differ, and below which they agree."""
CHANGE = 0.2
"""Part of a frame's energy that a change from one pass to the other costs, for each metre between them."""
BIAS = 5e-4
"""The same that a frame must gain at least."""
MOST_FRAMES = 240
"""Tracked backwards from one frame, at most: so many frames' cells are held in memory."""

FramesBackwards = Callable[[int, int], Iterable[FrameCells]]
"""The cells of the frames from the first to before the second, the last one first."""


@dataclass(frozen=True)
class Pass:
    """What tracking found, a row a frame."""

    poses: Float[np.ndarray, "frame dof"]
    doubts: Float[np.ndarray, "frame limb"]
    usual: Float[np.ndarray, "frame blob"]
    """As in `Judgement`."""
    energy: float
    """Of a frame, the mean of its magnitude."""
    capacities: Capacities
    """Of the last frame."""


@dataclass(frozen=True)
class Revised:
    """What holds for a frame of which some part comes from the other pass."""

    pose: Float[np.ndarray, "dof"]
    energy: float
    terms: dict[str, float]
    doubt: Float[np.ndarray, "limb"]


@dataclass
class Revision:
    """Frames that were revised, and which parts of the body were taken from the other pass in how many."""

    frames: dict[int, Revised] = field(default_factory=dict)
    parts: dict[str, int] = field(default_factory=dict)


def told_both_ways(tracker: Tracker, passed: Pass, frames: FramesBackwards) -> Revision:
    """Where another pass explains parts of the body better, among the frames around those that are in doubt.

    Args:
        tracker: that judges limbs.
        passed: what it found.
        frames: reads cells backwards, by rows of `passed`.
    """
    revision, reached = Revision(), len(passed.poses)
    for first, last in reversed(stretches(passed.doubts.max(axis=1, initial=0.0) > DOUBTFUL, SURE_FRAMES)):
        if last < reached:
            reached = _revise(tracker, passed, frames, first, last, revision)
    return revision


def stretches(marked: Bool[np.ndarray, "frame"], gap: int = 1) -> list[tuple[int, int]]:
    """First and last frames of the stretches that are marked; gaps of fewer frames than `gap` belong to them."""
    rows = np.flatnonzero(marked)
    parts = np.split(rows, np.flatnonzero(np.diff(rows) > gap) + 1) if len(rows) else []
    return [(int(part[0]), int(part[-1])) for part in parts]


@dataclass
class _Compared:
    """The frames of a backward pass beside the other, the last one first."""

    cells: list[FrameCells]
    poses: list[Float[np.ndarray, "dof"]]
    gains: list[Float[np.ndarray, "part"]]
    """By how much the energy rises if a part is taken from the backward pass."""
    apart: list[Float[np.ndarray, "part"]]
    """Metres."""


def _revise(tracker: Tracker, passed: Pass, frames: FramesBackwards, first: int, last: int, revision: Revision) -> int:
    """Track backwards from behind a stretch, and revise it; the first frame that was looked at."""
    parts = body_parts(tracker.body)
    found, begin = _backwards(tracker, passed, frames, parts, first, last)
    rows = begin - 1 - np.arange(len(found.poses))
    taken = taken_parts(parts, np.stack(found.apart), np.stack(found.gains), passed.energy)
    poses = passed.poses.copy()
    changed = np.flatnonzero(taken.any(axis=1))
    for k in changed:
        poses[rows[k]] = merged_pose(tracker.body, parts, poses[rows[k]], found.poses[k], taken[k])
    for k in changed:
        row = int(rows[k])
        before, before_that = (jnp.asarray(poses[max(row - j, 0)]) for j in (1, 2))
        history = History(before, before_that, jnp.asarray(row >= 2))
        cells, present = on_device(found.cells[k])
        pose, usual = jnp.asarray(poses[row]), jnp.asarray(passed.usual[row])
        value = _valued(tracker, history, cells, passed.capacities, present, pose, usual)
        energy, terms, judged = jax.device_get(value)
        values = {name: float(term) for name, term in terms.items()}
        revision.frames[row] = Revised(poses[row], float(energy), values, judged.doubt)
    for part, count in zip(parts, taken.sum(axis=0), strict=True):
        if count:
            revision.parts[part.name] = revision.parts.get(part.name, 0) + int(count)
    return int(rows[-1])


def taken_parts(
    parts: Sequence[Part],
    apart: Float[np.ndarray, "frame part"],
    gains: Float[np.ndarray, "frame part"],
    energy: float,
) -> Bool[np.ndarray, "frame part"]:
    """Which parts are taken from the other pass, in frames that follow each other; the pass itself holds around them.

    The choice that gains the most energy in sum, less what it costs to change from one pass to the other: the more,
    the farther apart they are there. A limb is looked at only where the trunk that it hangs on is in the same place in
    both passes; else the whole actor is taken, or left.

    Args:
        parts: of the body.
        apart: metres between the passes.
        gains: of taking each part.
        energy: of a frame, for scale.
    """
    taken = np.zeros(apart.shape, bool)
    for k, part in enumerate(parts):
        whole = 0.0 if part.whole is None else apart[:, part.whole]
        worth = np.where(whole > APART, 0.0, gains[:, k] / energy) - BIAS
        found = _best_choice(worth, CHANGE * apart[:, k])
        for first, last in stretches(found):
            stretch = slice(first, last + 1)
            taken[stretch, k] = apart[stretch, k].max() > APART
    return taken


def _best_choice(worth: Float[np.ndarray, "frame"], change: Float[np.ndarray, "frame"]) -> Bool[np.ndarray, "frame"]:
    """Where to take the other pass, by dynamic programming: `worth` for each frame, less `change` at both ends."""
    count = len(worth)
    best, chosen = np.array([0.0, -np.inf]), np.zeros((count + 1, 2), int)
    for t in range(count + 1):
        cost = change[min(t, count - 1)] if t in (0, count) else 0.5 * (change[t - 1] + change[t])
        ways = best[:, None] - cost * (1.0 - np.eye(2))
        chosen[t], best = ways.argmax(axis=0), ways.max(axis=0)
        best = best + np.array([0.0, worth[t] if t < count else -np.inf])
    taken, at = np.zeros(count, bool), 0
    for t in range(count, 0, -1):
        at = chosen[t, at]
        taken[t - 1] = at == 1
    return taken


def merged_pose(
    body: Body,
    parts: Sequence[Part],
    pose: Float[np.ndarray, "dof"],
    other: Float[np.ndarray, "dof"],
    taken: Bool[np.ndarray, "part"],
) -> Float[np.ndarray, "dof"]:
    """A pose with the parts that are taken from another one: whole actors as they are there, limbs in their places."""
    base, blobs = pose.copy(), np.zeros(body.num_blobs, bool)
    for part, is_taken in zip(parts, taken, strict=True):
        if is_taken and part.whole is None:
            base[part.dofs] = other[part.dofs]
        elif is_taken:
            blobs |= part.blobs
    if not blobs.any():
        return base
    return np.asarray(_with_blobs(body, jnp.asarray(base), jnp.asarray(other), jnp.asarray(blobs[None]))[0])


def _backwards(
    tracker: Tracker, passed: Pass, frames: FramesBackwards, parts: Sequence[Part], first: int, last: int
) -> tuple[_Compared, int]:
    """Track from the first frame behind a stretch until both passes agree again before it; and where it began."""
    total = len(passed.poses)
    begin = min(last + 1, total)  # no frame behind the clip's last one: its pose is where the pass begins
    after = [min(begin + k, total - 1) for k in (0, 1)]
    pose, before = (jnp.asarray(passed.poses[row]) for row in after)
    known, usual = 2 if begin < total else 0, jnp.asarray(passed.usual[after[0]])
    start = TrackState(pose, before, jnp.asarray(known), usual)
    found, seen = _Compared([], [], [], []), []
    lowest = max(0, begin - MOST_FRAMES)

    def coming() -> Iterable[FrameCells]:
        for frame in frames(lowest, begin):
            seen.append(frame)
            yield frame

    agree, choices = 0, _Choices.of(tracker.body, parts)
    for k, tracked in enumerate(track(tracker, start, coming(), passed.capacities)):
        row, both = begin - 1 - k, (jnp.asarray(passed.poses[begin - 1 - k]), jnp.asarray(tracked.result.pose))
        apart, gains = np.asarray(_apart(tracker.body, choices.blobs, *both)), np.zeros(len(parts))
        if apart.max(initial=0.0) > TOGETHER:
            cells, present = on_device(seen[k])
            gains = np.asarray(_gains(tracker, cells, tracked.capacities, present, choices, *both))
        found.cells.append(seen[k])
        found.poses.append(np.asarray(both[1]))
        found.gains.append(gains)
        found.apart.append(apart)
        agree = agree + 1 if apart.max(initial=0.0) <= TOGETHER else 0
        if row <= first and agree >= SURE_FRAMES:
            break
    return found, begin


@eqx.filter_jit
def _with_blobs(
    body: Body, pose: Float[Array, "dof"], other: Float[Array, "dof"], blobs: Bool[Array, "choice blob"]
) -> Float[Array, "choice dof"]:
    """The pose with some blobs where they are in the other one, for each choice of blobs.

    Angles cannot just be exchanged: where the trunk is turned a little, a limb would go elsewhere.
    """
    means, others = (body.posed_blobs(each).means for each in (pose, other))
    targets = jnp.where(blobs[..., None], others, means)
    return fitted_to_blobs(body, jnp.broadcast_to(pose, (len(blobs), len(pose))), targets)[0]


@eqx.filter_jit
def _apart(body: Body, blobs: Float[Array, "part blob"], pose: Array, other: Array) -> Float[Array, "part"]:
    """How far the blobs of each part are from those in another pose, in metres, on average."""
    apart = jnp.linalg.norm(body.posed_blobs(pose).means - body.posed_blobs(other).means, axis=-1)
    return (blobs @ apart) / blobs.sum(axis=1)


class _Choices(eqx.Module):
    """The parts as arrays: whole actors first, then limbs."""

    dofs: Bool[Array, "whole dof"]
    blobs: Bool[Array, "part blob"]

    @classmethod
    def of(cls, body: Body, parts: Sequence[Part]) -> "_Choices":
        whole = [part for part in parts if part.whole is None]
        dofs = np.zeros((len(whole), body.skeleton.num_dofs), bool)
        for k, part in enumerate(whole):
            dofs[k, part.dofs] = True
        return cls(jnp.asarray(dofs), jnp.asarray(np.stack([part.blobs for part in parts])))

    def mixed(self, body: Body, pose: Float[Array, "dof"], other: Float[Array, "dof"]) -> Float[Array, "part dof"]:
        """The pose with each part as it is in the other one."""
        limbs = _with_blobs(body, pose, other, self.blobs[len(self.dofs) :])
        return jnp.concatenate([jnp.where(self.dofs, other, pose), limbs])


@eqx.filter_jit
def _gains(
    tracker: Tracker,
    cells: UInt8[Array, "camera rows columns 3"],
    capacities: Capacities,
    present: Bool[Array, "camera"] | None,
    parts: _Choices,
    first: Float[Array, "dof"],
    second: Float[Array, "dof"],
) -> Float[Array, "part"]:
    """By how much the energy rises with each part of the second pose instead of that of the first.

    The mean over what holds around it: the rest of the first pose and that of the second, in what is seen near either.
    """
    mixed = jnp.concatenate([parts.mixed(tracker.body, first, second), parts.mixed(tracker.body, second, first)])

    def seen_near(at: Float[Array, "dof"]) -> Float[Array, "part"]:
        views, _, _ = tracker.views(cells, TrackState.from_pose(at), capacities, present)
        energy = FrameEnergy(tracker.body, views, History.unknown(at), tracker.terms)
        values = jax.lax.map(energy, jnp.concatenate([first[None], second[None], mixed]))
        into_first, into_second = values[2:].reshape(2, -1)
        return 0.5 * ((into_first - values[0]) + (values[1] - into_second))

    return 0.5 * (seen_near(first) + seen_near(second))


@eqx.filter_jit
def _valued(
    tracker: Tracker,
    history: History,
    cells: UInt8[Array, "camera rows columns 3"],
    capacities: Capacities,
    present: Bool[Array, "camera"] | None,
    pose: Float[Array, "dof"],
    usual: Float[Array, "blob"],
) -> tuple[Float[Array, ""], dict[str, Float[Array, ""]], Judgement]:
    """Energy, terms and doubts of a pose that is known."""
    views, _, _ = tracker.views(cells, TrackState.from_pose(pose), capacities, present)
    energy = FrameEnergy(tracker.body, views, history, tracker.terms)
    return energy(pose), energy.values(pose), tracker.judged(pose, usual, views.windows, cells, present)
