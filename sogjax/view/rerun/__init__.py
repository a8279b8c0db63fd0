"""Motions in Rerun; every call of Rerun in this project stands in this folder."""
