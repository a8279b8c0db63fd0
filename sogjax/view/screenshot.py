"""A picture of a motion without a display: what Rerun's viewer shows, or the overlay where it cannot draw."""

import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from sogjax.io.motion import Motion
from sogjax.io.motion_log import PER_FRAME, SOMETIMES_PER_FRAME
from sogjax.view.rerun.file import view_command

SIZE = "1600x1000"
ATTEMPTS, LONGEST = 3, 120
"""A viewer on a busy machine may take its picture before the file is loaded; seconds that it may take."""
FEWEST_COLORS = 2000
"""Of a picture in which the file was loaded; the empty window has fewer."""


def at_frame(motion: Motion, frame: int) -> Motion | None:
    """A motion of one frame (the recording's number); None: it has no such frame."""
    row = motion.frame == frame
    if not row.any():
        return None
    names = [name for name in (*PER_FRAME, *SOMETIMES_PER_FRAME) if getattr(motion, name) is not None]
    return replace(motion, **{name: getattr(motion, name)[row] for name in names})


def rerun_screenshot(path: Path, size: str = SIZE) -> UInt8[np.ndarray, "h w 3"] | None:
    """What Rerun's viewer shows of a file (BGR), drawn without a window; None: it cannot draw here."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.png"
        words = ["--headless", "--screenshot-to", str(picture), "--window-size", size, "--port", "auto"]
        for _ in range(ATTEMPTS):
            try:
                command = [*view_command(path), *words]
                subprocess.run(command, check=False, capture_output=True, timeout=LONGEST)
            except subprocess.TimeoutExpired:
                return None
            if not picture.is_file():
                return None
            drawn = cv2.imread(str(picture))
            if drawn is not None and _num_colors(drawn) >= FEWEST_COLORS:
                return drawn
    return None


def drawn_frames(motions: Sequence[Motion], frame: int) -> list[Motion]:
    """The motions that have a frame, of that frame only."""
    return [shown for motion in motions if (shown := at_frame(motion, frame)) is not None]


def _num_colors(picture: UInt8[np.ndarray, "h w 3"]) -> int:
    packed = picture.astype(np.uint32) @ np.array([1, 256, 65536], np.uint32)
    return len(np.unique(packed))
