"""What is thought of the frames of a run, as the motions of its actors hold it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from sogjax.model.body import Body
from sogjax.model.limbs import joint_limbs, limb_names
from sogjax.quality.limb_confidence import LimbConfidence


@dataclass(frozen=True)
class Judged:
    """What is thought of bodies and their limbs in some frames."""

    doubt: Float[np.ndarray, "frame limb"]
    explained: Float[np.ndarray, "frame actor"]
    overlap: Float[np.ndarray, "frame actor camera"]
    cameras: tuple[str, ...]

    @classmethod
    def of(cls, judgements: Sequence[LimbConfidence], cameras: Sequence[str]) -> "Judged":
        """Of frames one after the other."""
        rows = lambda name: np.stack([np.asarray(getattr(each, name), float) for each in judgements])
        return cls(rows("error_probability"), rows("explained"), rows("overlap"), tuple(cameras))

    def of_actor(self, actor: int, body: Body, limbs: slice) -> dict[str, Any]:
        """What a motion says of an actor, whose limbs are a part of all."""
        return {
            "limb_names": limb_names(body),
            "joint_limb": joint_limbs(body.skeleton),
            "limb_doubt": self.doubt[:, limbs],
            "explained": self.explained[:, actor],
            "overlap": self.overlap[:, actor],
            "camera_names": self.cameras,
        }
