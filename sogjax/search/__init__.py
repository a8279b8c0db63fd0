"""Poses without a hint: hypotheses for a frame, from keypoints or landmarks, and the merging of passes."""
