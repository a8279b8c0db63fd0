"""Reading and writing: recordings, calibrations, videos, actors, motions."""
