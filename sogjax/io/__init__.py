"""Files: recordings, calibrations, videos, keypoints, actors and motions are read and written here."""
