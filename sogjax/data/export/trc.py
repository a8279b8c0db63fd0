"""TRC, the tab-separated marker file of OpenSim: one point per bone, in metres, Y up."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.data.atomic import atomic_path
from sogjax.data.export.bones import bone_frames, bones_of, frame_time, world_turn
from sogjax.data.keypoints.scheme import KeypointScheme
from sogjax.data.motion import Motion

_JOINTS = {"hip": "Hip", "knee": "Knee", "ankle": "Ankle", "shoulder": "Shoulder", "elbow": "Elbow", "wrist": "Wrist"}
OPENSIM_NAMES = {"root": "Hip", "neck": "Neck"} | {
    f"{side}_{joint}": side[0].upper() + name for side in ("left", "right") for joint, name in _JOINTS.items()
}
"""The names that OpenSim models for video have (Pose2Sim's), by those of the default body's bones."""


def write_trc(path: Path, motion: Motion, up: str = "z") -> None:
    """Write the origins of all bones; those that OpenSim's models know get their names there.

    Raises:
        InputError: no frames, unevenly spaced frames, or a path that cannot be written.
    """
    rate = 1.0 / frame_time(path, motion)
    bones = bones_of(motion)
    _, positions = bone_frames(motion, bones, up, "y")
    _write(path, motion, rate, [OPENSIM_NAMES.get(name, name) for name in bones.names], positions)


def write_markers(path: Path, motion: Motion, scheme: KeypointScheme, up: str = "z") -> None:
    """Write the points of a keypoint scheme under its names, as Pose2Sim's triangulation does.

    Its X, Y, Z are Y, Z, X of a world with z up.

    Raises:
        InputError: the motion lacks a point (one of an earlier version may), or what `write_trc` refuses.
    """
    rate = 1.0 / frame_time(path, motion)
    points = np.stack([motion.joint(name).astype(float) for name in scheme.landmarks], axis=1)
    _write(path, motion, rate, list(scheme.keypoints), points @ world_turn(up, "y").T)


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
