"""Rerun's viewer: the command that opens a file, and the picture that it draws of one without a display."""

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from jaxtyping import UInt8

from sogjax.io.motion import Motion

ATTEMPTS, LONGEST, SIZE = 3, 120, "1600x1000"
"""A viewer on a busy machine may take its picture before the file is loaded; seconds that it may take; pixels of the
picture."""
FEWEST_COLORS = 2000
"""A picture in which the file was loaded has as many; the empty window has fewer."""


def view_command(path: Path, web: bool = False) -> list[str]:
    """The command that opens a Rerun file in a window, or serves it to a browser; reached from this machine only.

    The window listens for further data too, on all of the machine's addresses unless told otherwise.
    """
    command = [sys.executable, "-m", "rerun", str(path), "--bind", "127.0.0.1"]
    return [*command, "--serve-web"] if web else command


def rerun_screenshot(path: Path) -> UInt8[np.ndarray, "h w 3"] | None:
    """What Rerun's viewer shows of a file (BGR), drawn without a window; None: it cannot draw here."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.png"
        words = ["--headless", "--screenshot-to", str(picture), "--window-size", SIZE, "--port", "auto"]
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


def _num_colors(picture: UInt8[np.ndarray, "h w 3"]) -> int:
    return len(np.unique(picture.astype(np.uint32) @ np.array([1, 256, 65536], np.uint32)))


def drawn_frames(motions: Sequence[Motion], frame: int) -> list[Motion]:
    """The motions that have a frame (the recording's number), of that frame only."""
    return [motion.of_rows(motion.frame == frame) for motion in motions if frame in motion.frame]
