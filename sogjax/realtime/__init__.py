"""Tracking while pictures arrive: cameras or a replay, an assembler, a slot of size one, the tracker, publishers."""
