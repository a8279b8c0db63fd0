"""Comma-separated values: the origins of all bones in metres, in the motion's own world, whose vertical is stated."""

import csv
from pathlib import Path

import numpy as np

from sogjax.data.atomic import atomic_path
from sogjax.data.export.bones import bone_frames, bones_of
from sogjax.data.motion import Motion


def write_csv(path: Path, motion: Motion, up: str = "z") -> None:
    """Write one row per frame, after a line starting with `#` that gives unit and vertical, and the columns' names.

    Raises:
        InputError: a path that cannot be written.
    """
    bones = bones_of(motion)
    _, positions = bone_frames(motion, bones, up, up)
    columns = ["frame", "time", *(f"{name}.{axis}" for name in bones.names for axis in "xyz")]
    flat = positions.reshape(motion.num_frames, 3 * len(bones.names))
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(f"# unit: m, time: s, up: {up}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for frame, seconds, row in zip(motion.frame.tolist(), motion.time.tolist(), flat, strict=True):
            writer.writerow([frame, f"{seconds:.6f}", *(f"{value:.6f}" for value in np.asarray(row))])
