"""Studies: experiments that are described in `conf/experiment/`, run over several recordings, and reported."""
