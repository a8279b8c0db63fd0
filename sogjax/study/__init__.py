"""Experiments: `conf/experiment/` describes them; they are run over several recordings, and reported."""
