"""The pass that is known while it is revised: what of other passes is taken into it, and what that is worth."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.energy.views import Views
from sogjax.model.cores import in_threads
from sogjax.model.limbs import limb_names
from sogjax.model.program import compiled
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.search.body_parts import body_parts, merged_pose, select_parts
from sogjax.search.climbed import MORE, climbed_in
from sogjax.search.other_pass import BothSeen, Compared, Pass
from sogjax.search.tracklets import Tracklets
from sogjax.tracking.capacity import views_near
from sogjax.tracking.frame import AnyFrame, FrameInput, on_device
from sogjax.tracking.tracker import Tracker


@dataclass(frozen=True)
class Revised:
    """What holds for a frame of which some part comes from the other pass."""

    pose: Float[np.ndarray, "dof"]
    energy: float
    terms: dict[str, float]
    judged: LimbConfidence


@dataclass
class Revision:
    """Frames that were revised, and in which of them each part of the body was taken from the other pass."""

    frames: dict[int, Revised] = field(default_factory=dict)
    parts: dict[str, set[int]] = field(default_factory=dict)
    rivals: dict[int, Float[np.ndarray, "limb"]] = field(default_factory=dict)
    """Of the key rows: `LimbSearch.rivals`."""


class RevisedPass:
    """A pass into which parts of other passes are taken."""

    def __init__(self, tracker: Tracker, passed: Pass) -> None:
        self.tracker, self.passed = tracker, passed
        self.parts, self.revision = body_parts(tracker.body), Revision()
        self.part_blobs = jnp.asarray(np.stack([part.blobs for part in self.parts]))
        self.tracklets = Tracklets(tracker.body)
        """What is known of other passes."""
        self.changed: set[int] = set()
        """Rows that were revised; whoever asks clears it."""

    def take(self, found: Compared) -> set[int]:
        """Revise what another pass explains better, if the stretch gains, each pose climbed; the rows that changed."""
        rows = np.array(found.rows)
        apart, gains = np.stack(found.apart), np.stack(found.gains)
        ends, doubts = self._open_ends(found.rows), self._doubts(rows)
        taken = select_parts(self.parts, apart, gains, self.passed.energy, ends, doubts)
        changed = [(int(k), int(rows[k])) for k in np.flatnonzero(taken.any(axis=1))]
        poses = in_threads(lambda at: self._merged(self.passed.poses[at[1]], found, at[0], taken[at[0]]), changed)
        merged = {row: pose for (_, row), pose in zip(changed, poses, strict=True)}
        gained = in_threads(lambda at: self._gained(found, at[0], merged[at[1]]), changed)
        if not sum(gained) > 0.0:
            return set()
        self.put(found, merged, taken)
        return set(merged)

    def put(
        self,
        found: Compared,
        merged: Mapping[int, Float[np.ndarray, "dof"]],
        taken: Bool[np.ndarray, "frame part"] | None = None,
    ) -> None:
        """Put poses into the rows of another pass, of which parts were `taken`; None: what is elsewhere then."""
        rows = np.array(found.rows)
        if taken is None:
            by_itself = np.array([len(part.names) == 1 for part in self.parts])
            elsewhere = np.stack(found.apart) > fitted_numbers().merge_passes.apart
            taken = elsewhere & by_itself & np.isin(rows, [*merged])[:, None]
        for row, pose in merged.items():
            self.passed.poses[row] = pose
            self.passed.climbed.pop(row, None)
        in_threads(lambda k: self._revise(found.rows[k], found.cells[k]), np.flatnonzero(np.isin(rows, [*merged])))
        self.changed |= set(merged)
        self.tracklets.forget(merged)
        for part, of_part in zip(self.parts, taken.T, strict=True):
            for name in part.names if of_part.any() else ():
                self.revision.parts.setdefault(name, set()).update(rows[of_part].tolist())

    def _open_ends(self, rows: Sequence[int]) -> tuple[bool, bool]:
        """Whether the clip ends before the first and behind the last of some rows."""
        ends = (0, len(self.passed.poses) - 1)
        return rows[0] in ends, rows[-1] in ends

    def _doubts(self, rows: Int[np.ndarray, "frame"]) -> Float[np.ndarray, "frame part"]:
        """How likely a limb of each part is lost; 0 for whole actors."""
        names = limb_names(self.tracker.body)
        limbs = [[k for k, name in enumerate(names) if name in part.names] for part in self.parts]
        return np.stack([self.passed.doubts[rows][:, of_part].max(axis=1, initial=0.0) for of_part in limbs], axis=1)

    def _gained(self, found: Compared, k: int, merged: Float[np.ndarray, "dof"]) -> float:
        """What a frame gains with a merged pose, which may be that of the other pass, once both are climbed."""
        if np.array_equal(merged, found.poses[k]):
            return found.gained[k]
        row, passed = found.rows[k], self.passed
        seen = BothSeen.of(self.tracker, found.cells[k], passed.capacities, passed.poses[row], merged)
        return seen.climbed_gain(passed.climbed, row)

    def _merged(
        self, pose: Float[np.ndarray, "dof"], found: Compared, k: int, taken: Bool[np.ndarray, "part"]
    ) -> Float[np.ndarray, "dof"]:
        """A pose with the parts that are taken; the other pass's as it is, where the rest is alike, else climbed."""
        moved = np.any([part.blobs for part, is_taken in zip(self.parts, taken, strict=True) if is_taken], axis=0)
        rest = [np.any(part.blobs & ~moved) for part in self.parts]
        alike = np.where(rest & ~taken, found.apart[k], 0.0).max() <= fitted_numbers().merge_passes.apart
        if alike:
            return found.poses[k].copy()
        mixed = jnp.asarray(merged_pose(self.tracker.body, self.parts, pose, found.poses[k], taken))
        room = self.passed.capacities
        views = views_near(self.tracker, on_device(found.cells[k]), mixed, room)
        return np.asarray(climbed_in(self.tracker, views, mixed, MORE, room)[0])

    def _revise(self, row: int, frame: AnyFrame) -> None:
        """Note what the pose of a frame, which changed, is worth."""
        poses = self.passed.poses
        before, before_that = (jnp.asarray(poses[max(row - j, 0)]) for j in (1, 2))
        history = History(before, before_that, jnp.asarray(row >= 2))
        pose, baseline = jnp.asarray(poses[row]), jnp.asarray(self.passed.baseline[row])
        known = on_device(frame)
        views = views_near(self.tracker, known, pose, self.passed.capacities)
        found = _valued(self.tracker, history, known, views, pose, baseline)
        energy, terms, judged = jax.device_get(found)
        values = {name: float(term) for name, term in terms.items()}
        self.revision.frames[row] = Revised(poses[row].copy(), float(energy), values, judged)
        self.passed.energies[row], self.passed.doubts[row] = float(energy), judged.error_probability


@compiled
def _valued(
    tracker: Tracker,
    history: History,
    frame: FrameInput,
    views: Views,
    pose: Float[Array, "dof"],
    baseline: Float[Array, "2 blob"],
) -> tuple[Float[Array, ""], dict[str, Float[Array, ""]], LimbConfidence]:
    """Energy, terms and doubts of a pose that is known."""
    energy = FrameEnergy(tracker.body, views, history, tracker.terms)
    judged = tracker.judged(pose, baseline, views.windows, frame)
    return energy(pose), energy.values(pose), judged
