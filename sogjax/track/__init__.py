"""From frame to frame (Section 5.3)."""
