"""Following different hypotheses for a while: a wrong one pays as the motion goes on."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.tracking.mirrored import means_of
from sogjax.tracking.pose_search import Hunt, Optimum, Searcher, Tried, centres_of
from sogjax.tracking.seen_frame import SeenFrame

ITERATIONS = 8
SAME_WINDOW = 0.5
"""Metres between the middles of hypotheses that are looked at in the same windows, so that they can be compared."""


@dataclass(frozen=True)
class Followed:
    """Hypotheses through some frames."""

    poses: Float[np.ndarray, "frame hypothesis dof"]
    energies: Float[np.ndarray, "frame hypothesis"]
    means: Float[np.ndarray, "frame hypothesis blob 3"]
    """Of the blobs (metres, world)."""

    @property
    def apart(self) -> Float[np.ndarray, "frame hypothesis hypothesis"]:
        """Mean distance of the blobs of two hypotheses, in each frame (metres)."""
        return np.linalg.norm(self.means[:, :, None] - self.means[:, None], axis=-1).mean(axis=-1)


def followed(searcher: Searcher, optima: Sequence[Optimum], frames: Iterable[SeenFrame]) -> Followed:
    """Hypotheses climbed in the frame that they were found in, and from there in those that come after it."""
    poses, energies = [np.stack([optimum.pose for optimum in optima])], []
    for frame in frames:
        expected = poses[-1] if len(poses) < 3 else 2.0 * poses[-1] - poses[-2]
        climbed = _climbed(searcher, frame, expected.astype(poses[0].dtype))
        poses.append(climbed.poses)
        energies.append(climbed.values)
    everything = np.stack(poses[1:])
    means = means_of(searcher.body, everything.reshape(-1, everything.shape[-1]))
    return Followed(everything, np.stack(energies), means.reshape(*everything.shape[:2], -1, 3))


def _climbed(searcher: Searcher, frame: SeenFrame, poses: Float[np.ndarray, "hypothesis dof"]) -> Tried:
    """The hypotheses climbed, those near each other in the same windows."""
    centres = centres_of(searcher.body, poses)
    first = [int(np.argmax(np.linalg.norm(centres - centre, axis=1) < SAME_WINDOW)) for centre in centres]
    places, where = np.unique(first, return_inverse=True)
    middles = np.stack([centres[np.array(first) == place].mean(axis=0) for place in places])
    hunt = Hunt.of_places(searcher, frame, middles)
    return hunt.climbed(Tried(poses, where, np.zeros(len(poses))), ITERATIONS)
