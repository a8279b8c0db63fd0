"""`sogjax export`: a motion in another format."""

from pathlib import Path

from sogjax.app.configs import ExportConfig
from sogjax.app.outputs import free_path
from sogjax.data.export import export_motion
from sogjax.data.motion import load_motion
from sogjax.errors import InputError
from sogjax.model.frames import UP_AXES


def run(config: ExportConfig) -> Path:
    """Write the file.

    Raises:
        InputError: a motion that does not open, or an ending that no writer knows, or a file that is there.
    """
    if config.up not in UP_AXES:
        raise InputError(f"up={config.up}: must be one of {', '.join(UP_AXES)}")
    out = free_path("to", config.to, config.overwrite)
    export_motion(load_motion(Path(config.motion)), out, up=config.up)
    print(out)
    return out
