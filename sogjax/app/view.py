"""`sogjax view`: a motion in Rerun."""

import subprocess
import tempfile
from pathlib import Path

from sogjax.app.configs import ViewConfig
from sogjax.app.outputs import free_path
from sogjax.app.progress import progress
from sogjax.app.recordings import file_list, opened
from sogjax.data.ground_truth import load_ground_truth
from sogjax.data.motion import load_motion
from sogjax.data.video import read_frames
from sogjax.errors import InputError
from sogjax.view.frames import frame_range
from sogjax.view.rerun import view_command, write_rerun


def run(config: ViewConfig) -> Path:
    """Write the Rerun file, or open the viewer on it where no file is asked for.

    Raises:
        InputError: files that do not open or do not fit together, or a Rerun file that is there.
    """
    asked = None if config.out is None else free_path("out", config.out, config.overwrite)
    recording = opened(config.recording)
    motions = [load_motion(path) for path in file_list(config.motion)]
    out = Path(tempfile.mkdtemp()) / "motion.rrd" if asked is None else asked
    first, stop = (number - recording.first_frame for number in frame_range(recording, motions))
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
        ended = subprocess.run(view_command(out), check=False)
        if ended.returncode != 0:
            raise InputError(f"the Rerun viewer could not be opened on {out}; write a file with out=FILE.rrd instead")
    return out
