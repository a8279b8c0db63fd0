"""Motions of other systems, read to be compared with: a reader for each format, chosen by the ending of the file."""
