"""What way does a solver take within a frame?

python experiments/iterations.py [recording=walk:0] [frame=20] [options=[solver=lbfgs]] [to=iterations.rrd]

Tracks up to the frame, prints the energy and how far blobs moved after each of the iterations there, and writes
them for Rerun: the skeleton on a timeline of iterations, and every joint's way as a line.
"""

from dataclasses import dataclass, field
from pathlib import Path

import jax.numpy as jnp
import numpy as np

from sogjax.errors import InputError
from sogjax.io.motion import Motion, motion_from_poses
from sogjax.io.video import read_frames
from sogjax.settings.compose import track_config
from sogjax.settings.run import TrackConfig
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.settings import ReportConfig
from sogjax.study.source import Source, source_named
from sogjax.tracking.frame import TrackState
from sogjax.tracking.frame_by_frame import best_after, track
from sogjax.view.rerun.comparison import write_iterations


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
    setup = source.setup(config, source.cameras(None))
    tracker, first = setup.tracker, source.recording.first_frame
    frames = [*setup.clip.frames(first, first + frame + 1)]
    state = TrackState.from_pose(jnp.asarray(source.initial_pose.pose))
    tracked = list(track(tracker, state, frames))
    for done in tracked[:-1]:
        state = state.advanced(jnp.asarray(done.result.pose))
    counts = jnp.arange(int(tracked[-1].result.iterations) + 1)
    poses, energies = best_after(tracker, state, jnp.asarray(frames[-1].cells), tracked[-1].capacities, counts)
    return motion_from_poses(source.bodies[0], np.asarray(poses), source.recording.fps), np.asarray(energies)


@dataclass
class Settings:
    """What is tracked, as `key=value` on the command line."""

    recording: str = ReportConfig().recordings[0]
    frame: int = 20
    """Counted from the recording's first."""
    options: list[str] = field(default_factory=list)
    """Of track."""
    out: str = ReportConfig().out
    """Where actors and cells are kept."""
    to: str = "iterations.rrd"


def main() -> None:
    """Print a line for each iteration, and write the file."""
    settings = settings_from(Settings)
    source = source_named(settings.recording, settings.frame + 1, Path(settings.out))
    check_showable(source, settings.frame)
    steps, energies = watched(source, settings.options, settings.frame)
    print(machine_line())
    previous = steps.blob_means[0]
    for number, (energy, blobs) in enumerate(zip(energies, steps.blob_means, strict=True)):
        moved = 1000.0 * float(np.linalg.norm(blobs - previous, axis=-1).max())
        print(f"iteration {number:3}   energy {energy:.6f}   a blob moved by up to {moved:6.1f} mm")
        previous = blobs
    pictures = next(iter(read_frames(source.recording, settings.frame, settings.frame + 1)))
    write_iterations(Path(settings.to), source.recording, steps, energies, pictures)
    print(settings.to)


if __name__ == "__main__":
    run_script(main)
