"""TRC, the tab-separated marker file of OpenSim: joint centres and extremities, in metres, Y up."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.data.atomic import atomic_path
from sogjax.data.export.bones import frame_time
from sogjax.data.export.points import marker_points
from sogjax.data.motion import Motion


def write_trc(path: Path, motion: Motion, up: str = "z", markers: str | None = None) -> None:
    """Write the points of `marker_points`; those that OpenSim's models know have their names there.

    X, Y, Z are Y, Z, X of a world with z up, as in Pose2Sim's files.

    Raises:
        InputError: no frames, unevenly spaced frames, or a path that cannot be written; a keypoint scheme that is not
            known, or a motion that lacks one of its points.
    """
    rate = 1.0 / frame_time(path, motion)
    _write(path, motion, rate, *marker_points(motion, up, "y", markers))


def _write(
    path: Path, motion: Motion, rate: float, names: list[str], positions: Float[np.ndarray, "frame marker 3"]
) -> None:
    count, first = motion.num_frames, int(motion.frame[0])
    header = [
        ["PathFileType", "4", "(X/Y/Z)", path.name],
        ["DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame"],
        [f"{rate:.6f}", f"{rate:.6f}", str(count), str(len(names)), "m", f"{rate:.6f}", str(first)],
        ["Frame#", "Time", *(cell for name in names for cell in (name, "", ""))],
        ["", "", *(f"{axis}{k}" for k in range(1, len(names) + 1) for axis in "XYZ")],
        [],
    ]
    header[1].append("OrigNumFrames")
    header[2].append(str(count))
    rows = (
        [str(frame), f"{seconds:.6f}", *(f"{value:.6f}" for value in points.ravel())]
        for frame, seconds, points in zip(motion.frame.tolist(), motion.time.tolist(), positions, strict=True)
    )
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines("\t".join(cells) + "\n" for cells in (*header, *rows))
