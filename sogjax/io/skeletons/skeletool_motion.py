"""Skeletool's `.motion`: one line per frame with the values of all degrees of freedom, in millimetres and radians."""

from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError, counted
from sogjax.io.files import atomic_path
from sogjax.io.motion import DEFAULT_UP, Motion, motion_from_poses
from sogjax.io.text_lines import Lines
from sogjax.model.body import Body

HEADER = "Skeletool Motion File V1.0"
MAX_BYTES = 256 * 2**20
MILLIMETRES = 1000.0


def read_skeletool_motion(path: Path, body: Body, fps: float, up: str = DEFAULT_UP) -> Motion:
    """The motion of `body`, which stands upright in a world with the vertical `up`; the file has no frame rate.

    Raises:
        InputError: no such file, or a line that is not a frame and a value for every degree of freedom.
    """
    lines = Lines(path, MAX_BYTES)
    if " ".join(lines.take("the header")) != HEADER:
        raise lines.error(f"the header {HEADER!r}")
    count = body.skeleton.num_dofs
    expected = f"a frame and {counted(count, 'number')}, one for each degree of freedom of {body.name!r}"
    frames: list[int] = []
    poses: list[list[float]] = []
    while lines.left:
        words = lines.take(expected, (1 + count,))
        frame = lines.number(words[0], expected)
        if frame != round(frame) or (frames and frame <= frames[-1]):
            raise lines.error(f"{expected}; frames are whole numbers that increase")
        frames.append(int(frame))
        poses.append(lines.numbers(words[1:], expected))
    values = np.array(poses, float).reshape(-1, count) / file_units(body)
    return motion_from_poses(body, values, fps, frame=np.array(frames, int), up=up)


def write_skeletool_motion(path: Path, motion: Motion, body: Body) -> None:
    """Write the poses of a motion of `body`.

    Raises:
        InputError: the motion is not one of this body.
    """
    if tuple(motion.dof_names.tolist()) != body.skeleton.dof_names:
        raise InputError(
            f"{path}: the motion's degrees of freedom are not those of the body {body.name!r}; "
            "give the actor that was tracked as actor=..."
        )
    values = motion.pose.astype(float) * file_units(body)
    rows = (
        f"{frame} {' '.join(f'{value:.9g}' for value in row)}\n"
        for frame, row in zip(motion.frame.tolist(), values.tolist(), strict=True)
    )
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.write(f"{HEADER}\n")
        file.writelines(rows)


def file_units(body: Body) -> Float[np.ndarray, "dof"]:
    """What a metre or radian is in the file: degrees of freedom that only slide joints are lengths."""
    moves = np.asarray(body.skeleton.parameter_transform) != 0.0
    turns = (moves & np.asarray(body.skeleton.revolute)[:, None]).any(axis=0)
    return np.where(turns, 1.0, MILLIMETRES)
