"""The way that a solver takes within a frame of a recording."""

import jax.numpy as jnp
import numpy as np

from sogjax.errors import InputError
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.study.source import Source
from sogjax.tracking.frame import TrackState
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.iterations import best_after


def check_showable(source: Source, frame: int) -> None:
    """Refuse what has no iterations that could be shown.

    Raises:
        InputError: several people, or a frame that the recording has not, or its first, which is no step of tracking.
    """
    if len(source.bodies) > 1:
        raise InputError(
            f"{source.name}: has {len(source.bodies)} people, and the iterations of one can be shown; "
            "choose a recording of one person"
        )
    if not 0 < frame < source.recording.num_frames:
        raise InputError(
            f"frame={frame}: choose one of 1 to {source.recording.num_frames - 1}, frames of {source.name} "
            "after its first"
        )


def watched(source: Source, options: list[str], frame: int) -> tuple[Motion, np.ndarray]:
    """The poses after 0, 1, 2, ... iterations in a frame, as a motion, and their energies."""
    config: TrackConfig = track_config(options, recording=source.path)
    cameras = source.cameras(None)
    tracker, cells = source.tracker(config, cameras), source.cells(config.images.depth, cameras, 1)
    state = TrackState.from_pose(source.start)
    tracked = list(track(tracker, state, cells[: frame + 1]))
    for done in tracked[:-1]:
        state = state.advanced(jnp.asarray(done.result.pose))
    counts = jnp.arange(int(tracked[-1].result.iterations) + 1)
    poses, energies = best_after(tracker, state, jnp.asarray(cells[frame]), tracked[-1].capacities, counts)
    return motion_from_poses(source.bodies[0], np.asarray(poses), source.recording.fps), np.asarray(energies)
