"""A rendered person whose rough pose suits the small actor of `command_line.py`."""

import yaml

from sogjax.synth.render import render_recording
from sogjax.synth.settings import SynthSettings

LANDMARKS = ("pelvis", "chest", "neck", "left_elbow")


def rendered_person(folder, **settings):
    """Render a recording without example poses and plates; the landmarks left are those that the small actor has."""
    render_recording(SynthSettings(example_poses=False, background=False, **settings), folder)
    rough = yaml.safe_load((folder / "initial_pose.yaml").read_text())
    rough["landmarks"] = {name: rough["landmarks"][name] for name in LANDMARKS}
    (folder / "initial_pose.yaml").write_text(yaml.safe_dump(rough))
    return folder
