"""The clip as a whole: poses of all frames, the shape of the body, and cameras are adjusted together."""
