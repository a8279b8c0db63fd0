"""Skeletons of other programs as bodies: a reader for each format, chosen by the content of the file."""
