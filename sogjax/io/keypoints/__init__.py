"""Keypoints that other programs' detectors left beside a recording: OpenPose, RTMPose, MediaPipe, AlphaPose."""
