"""`sogjax export`: a motion or a calibration in another format."""

from pathlib import Path

from sogjax.app.configs import ExportConfig
from sogjax.app.outputs import free_path
from sogjax.data.calibration import CameraRig, load_calibration, save_calibration
from sogjax.data.export import export_motion
from sogjax.data.motion import load_motion
from sogjax.data.recording import open_recording
from sogjax.errors import InputError
from sogjax.model.frames import UP_AXES


def run(config: ExportConfig) -> Path:
    """Write the file.

    Raises:
        InputError: a motion or calibration that does not open, an ending that no writer knows, or a file that is there.
    """
    out = free_path("to", config.to, config.overwrite)
    if (config.motion is None) == (config.calibration is None):
        raise InputError("export needs motion=... or calibration=..., one of them (see sogjax export --help)")
    if config.calibration is not None:
        save_calibration(out, _rig(Path(config.calibration)))
    else:
        _export_motion(config, Path(str(config.motion)), out)
    print(out)
    return out


def _rig(path: Path) -> CameraRig:
    return open_recording(path).rig if path.is_dir() else load_calibration(path)


def _export_motion(config: ExportConfig, motion: Path, out: Path) -> None:
    if config.up not in (None, *UP_AXES):
        raise InputError(f"up={config.up}: must be one of {', '.join(UP_AXES)}")
    export_motion(load_motion(motion), out, up=config.up)
