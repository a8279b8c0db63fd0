"""Tables of frames as a run leaves them."""

import numpy as np

from sogjax.io.frame_table import FrameTable


def frame_table(poses, first=0, cameras=2, **columns):
    """What was found in frames that follow each other, with given poses."""
    count = len(poses)
    counted = {name: np.full(count, k) for k, name in enumerate(("iterations", "evaluations", "num_blocks"), 3)}
    views = {name: np.full((count, cameras), k) for k, name in enumerate(("num_near", "num_matching"), 9)}
    known = {"energy": np.linspace(0.1, 0.2, count), "converged": np.arange(count) % 2 == 0}
    return FrameTable(
        frame=first + np.arange(count),
        pose=np.asarray(poses, np.float32),
        capacities=np.full((count, 3), 256),
        terms={"similarity": np.linspace(0.3, 0.4, count)},
        **(counted | views | known | columns),
    )
