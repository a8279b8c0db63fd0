"""`sogjax view`: a motion in Rerun."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from sogjax.cli.schemas import ViewConfig
from sogjax.errors import InputError
from sogjax.io.frame_motions import load_motions
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.image_file import write_image
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.video import read_chosen, read_frames
from sogjax.run.recordings import file_list, opened
from sogjax.run.run_folder import free_path
from sogjax.run.terminal import progress, say
from sogjax.view.overlay import overlay_frame
from sogjax.view.projection import frame_range
from sogjax.view.rerun.file import write_rerun
from sogjax.view.rerun.viewer import drawn_frames, rerun_screenshot, view_command

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
"""Environment variables that name the display, if there is one."""


def run(config: ViewConfig) -> Path:
    """Write the Rerun file or a picture, or open the viewer if no file is requested.

    Raises:
        InputError: files that cannot be opened or do not match, an existing Rerun file, or no viewer.
    """
    if config.out is None:
        _require_display()
    asked = None if config.out is None else free_path("out", config.out, config.overwrite)
    recording = opened(config.recording)
    motions = [motion for path in file_list(config.motion) for motion in load_motions(path).values()]
    if asked is not None and asked.suffix.lower() == ".png":
        return _write_picture(asked, recording, motions, config)
    if config.frame is not None:
        raise InputError(f"frame={config.frame}: only a picture shows one frame; leave it out, or give out=NAME.png")
    out = Path(tempfile.mkdtemp()) / "motion.rrd" if asked is None else asked
    first, stop = frame_range(recording, motions)
    write_rerun(
        out,
        recording,
        motions,
        frames=read_frames(recording, first, stop) if config.images else None,
        truth=None if recording.ground_truth is None else load_ground_truth(recording.ground_truth),
        progress=progress,
    )
    print(out)
    if config.out is None:
        _open_viewer(out)
    return out


def _write_picture(out: Path, recording: Recording, motions: list[Motion], config: ViewConfig) -> Path:
    """Write one frame as Rerun draws it without a window, or over the pictures where it cannot."""
    first, stop = frame_range(recording, motions)
    frame = (first + stop) // 2 if config.frame is None else config.frame
    shown = drawn_frames(motions, frame)
    if not shown:
        raise InputError(f"frame={frame}: the motion has the frames {first} to {stop - 1}, not this one")
    pictures = [images for _, images in read_chosen(recording, [frame])] if config.images else None
    with tempfile.TemporaryDirectory() as folder:
        write_rerun(Path(folder) / "motion.rrd", recording, shown, frames=pictures)
        drawn = rerun_screenshot(Path(folder) / "motion.rrd")
    if drawn is None:
        say("Rerun's viewer cannot draw here (no Vulkan driver: mesa-vulkan-drivers); the overlay is drawn instead")
        images = pictures[0] if pictures else [None] * len(recording.rig)
        drawn = overlay_frame(images, recording.rig, shown, frame)
    write_image(out, drawn)
    print(out)
    return out


def _require_display() -> None:
    """Raise if no window can be opened; only Linux tells beforehand."""
    if sys.platform == "linux" and not any(os.environ.get(name) for name in DISPLAYS):
        raise InputError(
            "out=null: there is no display to open the Rerun viewer on; write a picture with out=FILE.png, or a file "
            "with out=FILE.rrd, and open it with `rerun FILE.rrd` where there is one"
        )


def _open_viewer(path: Path) -> None:
    """Open the viewer and wait until it is closed; its own output is only shown if it fails."""
    ended = subprocess.run(view_command(path), check=False, stderr=subprocess.PIPE, text=True, errors="replace")
    if ended.returncode != 0:
        said = ended.stderr.strip().splitlines()
        reason = f" ({said[-1].strip()})" if said else ""
        raise InputError(
            f"the Rerun viewer could not be opened on {path}{reason}; write a file with out=FILE.rrd instead"
        )
