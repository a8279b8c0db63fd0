"""From frame to frame (Section 5.3): predict, cull, solve, advance."""
