"""Solvers that maximise a smooth function; they know nothing of bodies and pictures."""
