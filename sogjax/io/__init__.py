"""Files: recordings, calibrations, videos, keypoints, actors and motions are read and written here.

What is wrong with a file is an `InputError`: one sentence with the file, the value and the remedy. Files appear whole.
"""
