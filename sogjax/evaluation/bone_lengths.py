"""Bone lengths of an actor against the truth's."""

import numpy as np
from jaxtyping import Float

from sogjax.data.ground_truth import GroundTruth
from sogjax.model.body import Body

BONES = {
    "upper arm": ("{side}_shoulder", "{side}_elbow"),
    "forearm": ("{side}_elbow", "{side}_wrist"),
    "thigh": ("{side}_hip", "{side}_knee"),
    "shank": ("{side}_knee", "{side}_ankle"),
    "shoulders": ("left_shoulder", "right_shoulder"),
    "hips": ("left_hip", "right_hip"),
}
"""By the names of landmarks of `human`; left and right are taken together."""


def bone_errors(body: Body, truth: GroundTruth) -> dict[str, float]:
    """Relative deviation of each bone's length from the mean distance of the truth's joints; 0.01 is 1 % too long."""
    assert truth.joints is not None
    landmarks = np.asarray(body.posed_landmarks(body.poses["rest"]), float)[None]
    true_names = [landmark_named(name) for name in truth.joint_names]
    return {
        bone: _length(landmarks, body.landmarks.names, ends) / _length(truth.joints, true_names, ends) - 1.0
        for bone, ends in BONES.items()
    }


def landmark_named(joint: str) -> str:
    """`ACTOR/l_knee` is `left_knee`."""
    name = joint.split("/")[-1]
    sides = {"l_": "left_", "r_": "right_"}
    return sides[name[:2]] + name[2:] if name[:2] in sides else name


def _length(
    points: Float[np.ndarray, "frame point 3"], names: list[str] | tuple[str, ...], ends: tuple[str, str]
) -> float:
    """Mean distance of two points over frames and sides, metres."""
    at = lambda name: points[:, list(names).index(name)]
    spans = [at(ends[0].format(side=side)) - at(ends[1].format(side=side)) for side in ("left", "right")]
    return float(np.nanmean(np.linalg.norm(spans, axis=-1)))
