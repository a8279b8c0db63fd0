"""What is known of the actors at one moment: what publishers pass on and programs iterate over."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from sogjax.realtime.figures import Stamps
from sogjax.tracking.frame import TrackedFrame


@dataclass(frozen=True)
class ActorState:
    """One actor at one moment, in the recording's world; metres and radians."""

    name: str
    tracked: bool
    """Whether it is seen where it is thought to be; its pose is a guess otherwise."""
    pose: Float[np.ndarray, "dof"]
    world_from_joint: Float[np.ndarray, "joint 4 4"]
    explained: float
    """The part of its visible area that shows its own colours, 0 to 1."""
    limb_doubt: Float[np.ndarray, "limb"]
    """How likely each limb is more than 10 cm off, 0 to 1."""


@dataclass(frozen=True)
class LiveState:
    """All actors at one moment, and when its pictures were taken, solved and sent."""

    frame: int
    """Counted at the rate of the cameras; of a replay the recording's number, in its first pass."""
    stamps: Stamps
    present: tuple[bool, ...]
    """The cameras whose pictures were used."""
    actors: tuple[ActorState, ...]
    """None of them where nobody is in view, or not found yet."""
    tracked_frame: TrackedFrame | None = field(default=None, repr=False)
    """What the solver said; None where nobody was tracked."""

    @property
    def tracked(self) -> bool:
        """Whether every actor is."""
        return bool(self.actors) and all(actor.tracked for actor in self.actors)
