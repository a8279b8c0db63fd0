"""How far off one pose is, and in what way: limbs elsewhere, left and right exchanged, back to front."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from sogjax.io.ground_truth import GroundTruth
from sogjax.model.body import Body
from sogjax.study.verdicts import LimbErrors, limb_errors

RIGHT = 0.10
"""Metres, mean over the joints: a pose farther off is wrong."""
EXCHANGED, CLEARLY = 0.05, 0.7
"""Metres that a pair of limbs is off, and what part of that is left with left and right exchanged, where they are."""
OTHER_SIDE = {"l_": "r_", "r_": "l_", "left_": "right_", "right_": "left_"}


@dataclass(frozen=True)
class FoundError:
    """Of one pose."""

    joints: float
    """Metres, mean."""
    worst_limb: str
    worst: float
    """Metres, mean over that limb's joints."""
    kind: str
    """`right`, or what is wrong."""

    @property
    def is_right(self) -> bool:
        """Near enough, and nothing is exchanged."""
        return self.kind == "right"


def found_error(body: Body, pose: Float[np.ndarray, "dof"], truth: GroundTruth, frame: int) -> FoundError:
    """The error of a body's pose (upright in the world) in a frame of the recording."""
    truth = truth.subject(body.name) if truth.subjects else truth
    errors_of = lambda known: limb_errors([body], known, np.array([frame]), pose[None])
    errors = errors_of(truth)
    mirrored = errors_of(replace(truth, joint_names=tuple(map(other_side, truth.joint_names))))
    worst = int(np.nanargmax(errors.limbs[0]))
    joints = float(errors.mean[0])
    return FoundError(joints, errors.names[worst], float(errors.limbs[0, worst]), kind_of(joints, errors, mirrored))


def kind_of(joints: float, errors: LimbErrors, mirrored: LimbErrors) -> str:
    """What a pose is, from its errors and those against the truth with left and right exchanged (one frame)."""
    exchanged = [part for part in ("arm", "leg", "trunk") if _is_exchanged(part, errors, mirrored)]
    if "trunk" in exchanged:
        return "back to front"
    if exchanged:
        return " and ".join(f"{part}s" for part in exchanged) + " exchanged"
    if joints <= RIGHT:
        return "right"
    far = [name for name, limb in zip(errors.names, errors.limbs[0], strict=True) if limb > RIGHT]
    return "elsewhere" if "trunk" in far else f"misplaced: {', '.join(far)}" if far else "far off on the whole"


def other_side(joint: str) -> str:
    """The name of the joint on the other side of the body."""
    return next((OTHER_SIDE[side] + joint.removeprefix(side) for side in OTHER_SIDE if joint.startswith(side)), joint)


def _is_exchanged(part: str, errors: LimbErrors, mirrored: LimbErrors) -> bool:
    off, other = _mean_of(part, errors), _mean_of(part, mirrored)
    return off > EXCHANGED and other < CLEARLY * off


def _mean_of(part: str, errors: LimbErrors) -> float:
    """Of the limbs that are such a part; 0 where there is none."""
    values = [errors.limbs[0, k] for k, name in enumerate(errors.names) if name.endswith(part)]
    return float(np.mean(values)) if values else 0.0
