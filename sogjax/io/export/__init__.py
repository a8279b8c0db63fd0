"""Motions in the formats of other programs: a writer for each format, chosen by the ending of the file."""
