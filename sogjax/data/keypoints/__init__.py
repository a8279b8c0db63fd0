"""Keypoints that other programs' detectors left beside a recording: OpenPose, RTMPose, MediaPipe, AlphaPose."""

from sogjax.data.keypoint_files import find_keypoints
from sogjax.data.keypoints.keypoints import Keypoints
from sogjax.data.keypoints.load import load_keypoints
from sogjax.data.keypoints.scheme import KeypointScheme, named_scheme, shipped_schemes

__all__ = ["KeypointScheme", "Keypoints", "find_keypoints", "load_keypoints", "named_scheme", "shipped_schemes"]
