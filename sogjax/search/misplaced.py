"""Actors that are followed where they are not, searched for again in frames out of which the other actors are taken.

Little of such an actor is explained by what is seen. Where his neighbours are is known by now, which it was not when
tracking began.
"""

from collections.abc import Iterator, Sequence
from functools import cached_property

import jax
import numpy as np
from jaxtyping import Bool, Float

from sogjax.model.body import Body
from sogjax.quality.metrics import stretches
from sogjax.search.body_parts import body_parts
from sogjax.search.limb_search import WORTH, LimbSearch
from sogjax.search.other_pass import SURE_FRAMES, BothSeen, Pass
from sogjax.search.pose_search import PoseSearch, search
from sogjax.search.seen_frame import SeenFrame
from sogjax.search.turned_body import WHOLE
from sogjax.tracking.frame import AnyFrame, on_device
from sogjax.tracking.tracker import Tracker

LOOKS = (0.5, 0.2, 0.8)
"""Where in a stretch an actor is looked for, as parts of its length."""


class Misplaced:
    """Looks for actors in frames in which little of them is explained."""

    def __init__(
        self,
        tracker: Tracker,
        bodies: Sequence[Body],
        up: str,
        explained: Float[np.ndarray, "frame actor"],
        least: Float[np.ndarray, "actor"],
    ) -> None:
        """`explained` is what each frame explains of each actor, who is misplaced where that is less than `least`."""
        self.tracker, self.bodies, self.up = tracker, bodies, up
        self.explained, self.least = np.array(explained), least
        self._wholes = [part for part in body_parts(tracker.body) if part.whole is None]

    @cached_property
    def _searchers(self) -> list[PoseSearch]:
        return [PoseSearch.of_body(body, self.tracker.terms, self.up) for body in self.bodies]

    @property
    def _is_misplaced(self) -> Bool[np.ndarray, "frame actor"]:
        return self.explained < self.least

    def places(self) -> Iterator[tuple[int, int]]:
        """Frames to look in, and actors: in the middle of each stretch and, where nothing is found, elsewhere in it."""
        for actor in range(len(self.bodies)):
            for first, stop in stretches(self._is_misplaced[:, actor], at_least=SURE_FRAMES, gap=SURE_FRAMES):
                for share in LOOKS:
                    row = first + int(share * (stop - first))
                    if self._is_misplaced[row, actor]:
                        yield row, actor

    def pose(
        self, limbs: LimbSearch, frame: AnyFrame, passed: Pass, row: int, actor: int
    ) -> Float[np.ndarray, "dof"] | None:
        """The pose of a frame with an actor elsewhere, his limbs held as fits there, if that is worth more."""
        known, whole, found, best = passed.poses[row], self._wholes[actor], None, WORTH * passed.energy
        for optimum in search(self._searchers[actor], self._seen(frame, known, actor)):
            pose = known.copy()
            pose[whole.dofs] = optimum.pose
            views = limbs.views(on_device(frame), pose)
            pose = limbs.climbed(views, pose, pose[None], np.array([WHOLE]))[0][0]
            gain = BothSeen.of(self.tracker, frame, passed.capacities, known, pose).gain
            if gain > best and limbs.possible(known, pose[None])[0]:
                found, best = pose, gain
        if found is None:
            return None
        views = limbs.views(on_device(frame), found)
        return limbs.with_better_limbs(views, found, found, passed.energy).pose

    def _seen(self, frame: AnyFrame, pose: Float[np.ndarray, "dof"], actor: int) -> SeenFrame:
        """A frame as it is compared with one actor, where the others are in a pose."""
        cells, present, *_ = jax.device_get(on_device(frame))
        clusters, tracker = self._searchers[actor].clusters, self.tracker
        shown = None if present is None else np.asarray(present).tolist()
        seen = SeenFrame.from_cells(tracker.cameras, tracker.reader, cells, clusters, shown)
        for k, (body, other) in enumerate(zip(self.bodies, self._wholes, strict=True)):
            if k != actor:
                seen = seen.with_found(body, pose[other.dofs])
        return seen
