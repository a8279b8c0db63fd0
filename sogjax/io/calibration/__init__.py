"""Camera calibrations: a reader for each format, chosen by the content of the file."""
