"""Sweeps: a command for every combination of settings."""
