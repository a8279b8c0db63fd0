"""Joint angles of a motion against those of a recording's truth."""

import numpy as np
from jaxtyping import Int

from sogjax.io.export.angles import has_angles, joint_angles
from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.quality.angle_errors import AngleError, angle_errors
from sogjax.quality.line_angles import angles_between
from sogjax.quality.metrics import landmark_named


def errors_of_angles(
    motion: Motion, rows: Int[np.ndarray, "common"], truth: GroundTruth, truth_rows: Int[np.ndarray, "common"]
) -> tuple[AngleError, ...]:
    """Errors of joint angles (degrees) in the rows that both have.

    Where the truth has none, or the motion is that of another kind of body, they are those of the angles between the
    lines that join the joints.
    """
    if truth.angles is not None and has_angles(motion):
        true = dict(zip(truth.angle_names, np.asarray(truth.angles, float)[truth_rows].T, strict=True))
        return angle_errors(joint_angles(motion.of_rows(rows), motion.up), true)
    if truth.joints is None:
        return ()
    known = {*motion.joint_names.tolist(), *(() if motion.landmark_names is None else motion.landmark_names.tolist())}
    names = {landmark_named(name): k for k, name in enumerate(truth.joint_names) if landmark_named(name) in known}
    true = {name: np.asarray(truth.joints[truth_rows, k], float) for name, k in names.items()}
    return angle_errors(angles_between({name: motion.joint(name)[rows] for name in names}), angles_between(true))
