"""What comes from disk and goes to it: recordings, calibrations, videos, actors, motions."""
