"""What Rerun's own viewer draws of each kind of file, without a display, where a Vulkan driver is there."""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from motion_cases import walking_motion
from rig_cases import black, recording_of, ring_rig

from sogjax.view.rerun.comparison import write_comparison, write_iterations
from sogjax.view.rerun.file import write_rerun

DRIVERS = [path for folder in ("/usr/share", "/etc") for path in Path(folder).glob("vulkan/icd.d/*.json")]
BLUE, YELLOW, RED = (64, 156, 255), (255, 236, 140), (255, 96, 64)
"""Left, middle and right bones of the first actor."""
GREEN = (40, 220, 190)
"""Left bones of the second one."""
GREY = (40, 40, 40)
"""The pictures."""
WAY = (255, 220, 90)
"""The way of a joint through the iterations."""
FRAMES = 6
SCENES = 0.73
"""Of the window's height; the plots are below."""

pytestmark = pytest.mark.skipif(not DRIVERS, reason="no Vulkan driver (Debian: mesa-vulkan-drivers)")


ATTEMPTS = 5
"""A viewer on a busy machine may take its picture before the file is loaded."""


def shown(path, *colors):
    """The viewer's window with a file opened, RGB; the colours are waited for."""
    picture = path.with_suffix(".png")
    words = [str(path), "--headless", "--screenshot-to", str(picture), "--window-size", "1200x800"]
    command = [str(Path(sys.executable).with_name("rerun")), *words, "--port", "auto", "--bind", "127.0.0.1"]
    for _ in range(ATTEMPTS):
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
        if not picture.is_file():
            pytest.skip(f"the Vulkan driver does not draw: {done.stderr[-300:]}")
        found = cv2.cvtColor(cv2.imread(str(picture)), cv2.COLOR_BGR2RGB)
        if all(has_color(found, color) for color in colors):
            return found
    pytest.fail(f"not all of the colours {colors} were drawn")


def has_color(picture, color, tolerance=12):
    """Whether a line of that colour is drawn, not single pixels of a smoothed edge."""
    return int((np.abs(picture.astype(int) - color).max(axis=-1) <= tolerance).sum()) > 100


@pytest.fixture
def recording():
    return recording_of(ring_rig(), FRAMES)


@pytest.fixture
def pictures():
    """Dark grey, so that only what is drawn over them has a colour."""
    return [[image + np.uint8(40) for image in black(ring_rig())] for _ in range(FRAMES)]


def test_a_tracked_skeleton(tmp_path, recording, pictures):
    write_rerun(tmp_path / "motion.rrd", recording, [walking_motion(FRAMES)], frames=pictures)
    picture = shown(tmp_path / "motion.rrd", BLUE, YELLOW, RED, GREY)
    assert not has_color(picture, GREEN)


def test_runs_side_by_side(tmp_path, recording, pictures):
    runs = {name: [walking_motion(FRAMES, still=still)] for name, still in (("a", False), ("b", True))}
    write_comparison(tmp_path / "runs.rrd", recording, runs, frames=pictures)
    picture = shown(tmp_path / "runs.rrd", BLUE, GREEN)
    height, half = int(SCENES * picture.shape[0]), picture.shape[1] // 2
    scenes, plots = picture[:height], picture[height:]
    assert has_color(scenes[:, :half], BLUE)
    assert not has_color(scenes[:, :half], GREEN)
    assert not has_color(scenes[:, half:], BLUE)
    for color in (BLUE, GREEN):  # a run's curves have the colours of its body
        assert has_color(plots, color)


def test_iterations(tmp_path, recording, pictures):
    write_iterations(tmp_path / "steps.rrd", recording, walking_motion(FRAMES), np.arange(6.0), pictures[0])
    shown(tmp_path / "steps.rrd", BLUE, RED, WAY)
