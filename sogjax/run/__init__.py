"""From a recording to its results: the passes in their order, and the files that they leave."""
