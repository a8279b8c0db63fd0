"""Points of a figure whose true places a recording knows: landmarks (joint centres) and surface markers."""

import numpy as np
from jaxtyping import Float, Int

from sogjax.synth.anatomy import INDEX, SIDES, Anatomy, Pose
from sogjax.synth.figure import Figure
from sogjax.synth.flesh import AVERAGE_STATURE, PARTS, bind_pose

Offset = tuple[float, float, float]

_LANDMARKS: dict[str, tuple[str, Offset]] = {
    "pelvis": ("pelvis", (0.0, 0.0, 0.0)),
    "chest": ("chest", (0.01, 0.0, 0.05)),
    "neck": ("neck", (0.0, 0.0, 0.0)),
    "head_top": ("head", (0.004, 0.0, 0.168)),
}
_SIDE_LANDMARKS: dict[str, tuple[str, Offset]] = {
    "shoulder": ("shoulder", (0.0, 0.0, 0.0)),
    "elbow": ("elbow", (0.0, 0.0, 0.0)),
    "wrist": ("wrist", (0.0, 0.0, 0.0)),
    "hand": ("wrist", (0.002, 0.0, -0.08)),
    "hip": ("hip", (0.0, 0.0, 0.0)),
    "knee": ("knee", (0.0, 0.0, 0.0)),
    "ankle": ("ankle", (0.0, 0.0, 0.0)),
    "toe": ("toe", (0.03, 0.0, 0.0)),
}
"""Landmark: joint and offset from it, metres on a person of average stature."""

_FACE_AND_FEET: dict[str, tuple[str, Offset]] = {"nose": ("head", (0.118, 0.0, 0.025))}
_SIDE_FACE_AND_FEET: dict[str, tuple[str, Offset]] = {
    "eye": ("head", (0.096, 0.033, 0.058)),
    "ear": ("head", (-0.004, 0.088, 0.04)),
    "heel": ("ankle", (-0.066, 0.0, -0.045)),
    "small_toe": ("toe", (0.0, 0.042, -0.004)),
}
"""What keypoint detectors find besides the landmarks."""

_MARKERS: dict[str, tuple[str, str, Offset]] = {
    "head_front": ("head", "head", (0.11, 0.0, 0.09)),
    "head_back": ("head", "head", (-0.11, 0.0, 0.08)),
    "head_left": ("head", "head", (0.0, 0.09, 0.09)),
    "head_right": ("head", "head", (0.0, -0.09, 0.09)),
    "c7": ("torso", "neck", (-0.09, 0.0, 0.0)),
    "breastbone": ("torso", "chest", (0.13, 0.0, 0.08)),
    "back": ("torso", "chest", (-0.13, 0.0, -0.05)),
    "sacrum": ("torso", "pelvis", (-0.15, 0.0, 0.06)),
}
_SIDE_MARKERS: dict[str, tuple[str, str, Offset]] = {
    "chest": ("torso", "chest", (0.13, 0.095, 0.06)),
    "shoulder_top": ("torso", "clavicle", (0.0, 0.12, 0.06)),
    "hip_front": ("torso", "pelvis", (0.11, 0.11, 0.07)),
    "upper_arm": ("arm", "shoulder", (0.0, 0.08, -0.15)),
    "elbow_outside": ("arm", "elbow", (-0.02, 0.06, 0.0)),
    "forearm": ("arm", "elbow", (0.0, 0.06, -0.12)),
    "wrist_front": ("arm", "wrist", (0.05, 0.0, 0.0)),
    "wrist_back": ("arm", "wrist", (-0.05, 0.0, 0.0)),
    "hand": ("arm", "wrist", (0.0, 0.04, -0.08)),
    "thigh": ("leg", "hip", (0.03, 0.12, -0.22)),
    "knee_outside": ("leg", "knee", (0.02, 0.09, 0.0)),
    "shin": ("leg", "knee", (0.09, 0.0, -0.2)),
    "ankle_outside": ("leg", "ankle", (0.0, 0.07, 0.0)),
    "heel": ("leg", "ankle", (-0.1, 0.0, -0.03)),
    "toe": ("leg", "toe", (0.10, 0.0, 0.0)),
}
"""Marker: part of the body, joint, and a point (left side) whose nearest vertex on that part it is."""


def _two_sided(centre: dict, side: dict) -> dict:
    """Both tables as one, the right side mirrored; values end with joint and offset."""
    table = dict(centre)
    for name in SIDES:
        for key, (*part, joint, (x, y, z)) in side.items():
            sided = [f"{name}_{p}" if p in ("arm", "leg") else p for p in part]
            bone = f"{name}_{joint}" if f"{name}_{joint}" in INDEX else joint
            table[f"{name}_{key}"] = (*sided, bone, (x, y if name == "left" else -y, z))
    return table


LANDMARKS: dict[str, tuple[str, Offset]] = _two_sided(_LANDMARKS, _SIDE_LANDMARKS)
KEYPOINTS: dict[str, tuple[str, Offset]] = LANDMARKS | _two_sided(_FACE_AND_FEET, _SIDE_FACE_AND_FEET)
"""What the keypoints of a scheme are points of; the landmarks come first."""
MARKERS: dict[str, tuple[str, str, Offset]] = _two_sided(_MARKERS, _SIDE_MARKERS)


def landmark_points(anatomy: Anatomy, pose: Pose) -> Float[np.ndarray, "landmark 3"]:
    """The landmarks in the world, in the order of `LANDMARKS`."""
    return keypoint_points(anatomy, pose, np.zeros((len(KEYPOINTS), 3)))[: len(LANDMARKS)]


def keypoint_points(
    anatomy: Anatomy, pose: Pose, shifts: Float[np.ndarray, "keypoint 3"]
) -> Float[np.ndarray, "keypoint 3"]:
    """What keypoints are of, in the world, in the order of `KEYPOINTS`; shifted in their joints' frames, metres."""
    frames = anatomy.world_from_joint(pose)
    scale = anatomy.stature / AVERAGE_STATURE
    places = zip(KEYPOINTS.values(), shifts, strict=True)
    return np.stack([_point(frames, joint, scale * np.array(offset) + shift) for (joint, offset), shift in places])


def marker_vertices(figure: Figure) -> Int[np.ndarray, "marker"]:
    """The vertices that carry the markers, in the order of `MARKERS`."""
    frames = figure.anatomy.world_from_joint(bind_pose(figure.anatomy))
    scale = figure.anatomy.stature / AVERAGE_STATURE
    vertices = []
    for part, joint, offset in MARKERS.values():
        target = _point(frames, joint, scale * np.array(offset))
        candidates = np.unique(figure.faces[figure.face_part == PARTS.index(part)])
        gaps = np.linalg.norm(figure.rest[candidates] - target, axis=1)
        vertices.append(candidates[np.argmin(gaps)])
    return np.array(vertices)


def _point(frames: Float[np.ndarray, "22 4 4"], joint: str, offset: Float[np.ndarray, "3"]) -> np.ndarray:
    frame = frames[INDEX[joint]]
    return frame[:3, :3] @ offset + frame[:3, 3]
