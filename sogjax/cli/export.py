"""`sogjax export`, a motion or a calibration in another format, and `sogjax body`, a body from another program."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import jax.numpy as jnp

from sogjax.cli.schemas import BodyConfig, ExportConfig
from sogjax.errors import InputError, counted
from sogjax.io.actor_file import save_body
from sogjax.io.calibration.load import load_calibration, save_calibration
from sogjax.io.calibration.rig import METRES, CameraRig
from sogjax.io.export.angles import write_angles_csv
from sogjax.io.export.points import write_c3d, write_trc
from sogjax.io.export.write import DIALECTS, endings_beside, export_motion, write_initial_pose
from sogjax.io.frame_motions import load_one_motion
from sogjax.io.motion import Motion
from sogjax.io.motion_data import DEFAULT_UP
from sogjax.io.recording import open_recording
from sogjax.io.skeletons.load import read_skeleton
from sogjax.io.skeletons.skeletool import read_skeletool_motion, write_skeletool_motion
from sogjax.model.body import Body
from sogjax.model.rotation import UP_AXES, world_from_upright
from sogjax.run.recordings import body_named, file_list
from sogjax.run.run_folder import free_path


def run(config: ExportConfig) -> Path:
    """Write the file.

    Raises:
        InputError: a motion or calibration that cannot be opened, an unknown ending, or a file that already exists.
    """
    out = free_path("to", config.to, config.overwrite)
    if config.dialect is not None and (config.dialect not in DIALECTS or out.suffix.lower() != ".bvh"):
        raise InputError(f"dialect={config.dialect}: a .bvh may be of {', '.join(DIALECTS)}; leave it out of others")
    if (config.motion is None) == (config.calibration is None):
        raise InputError("export needs motion=... or calibration=..., one of them (see sogjax export --help)")
    if config.calibration is not None:
        save_calibration(out, _rig(Path(config.calibration)))
    else:
        _export_motion(config, file_list(config.motion), out)
    print(out)
    return out


def body(config: BodyConfig) -> Path:
    """Read a skeleton, attach blobs if it has none, and write the body file.

    Raises:
        InputError: an invalid file or option, or a body file that already exists.
    """
    if config.up not in UP_AXES:
        raise InputError(f"up={config.up}: must be one of {', '.join(UP_AXES)}")
    if config.unit not in (None, *METRES):
        raise InputError(f"unit={config.unit}: must be one of {', '.join(METRES)}")
    out = free_path("out", config.out, config.overwrite)
    dof = None if config.dof is None else Path(config.dof)
    read = read_skeleton(Path(config.from_), dof, config.unit, config.up)
    save_body(out, read)
    skeleton = read.skeleton
    dofs = counted(skeleton.num_dofs, "degree of freedom", "degrees of freedom")
    print(f"{counted(skeleton.num_joints, 'joint')}, {dofs}, {counted(read.num_blobs, 'blob')}")
    print(out)
    return out


def _rig(path: Path) -> CameraRig:
    return open_recording(path).rig if path.is_dir() else load_calibration(path)


def _export_motion(config: ExportConfig, sources: Sequence[Path], out: Path) -> None:
    is_pose = out.suffix.lower() in (".yaml", ".yml")
    if config.frame is not None and not is_pose:
        raise InputError(f"frame={config.frame}: only a .yaml holds one frame; leave it out, or write to=NAME.yaml")
    if len(sources) != 1 and not is_pose:
        raise InputError(f"motion={','.join(map(str, sources))}: {out.suffix} holds one motion; give one")
    if is_pose:
        write_initial_pose(out, [_read_motion(config, source) for source in sources], config.frame)
    else:
        _export_one(config, sources[0], out)


def _export_one(config: ExportConfig, source: Path, out: Path) -> None:
    if config.up not in (None, *UP_AXES):
        raise InputError(f"up={config.up}: must be one of {', '.join(UP_AXES)}")
    write_points = {".trc": write_trc, ".c3d": write_c3d}.get(out.suffix.lower())
    if config.markers is not None and write_points is None:
        raise InputError(
            f"markers={config.markers}: only .trc and .c3d have markers; leave it out, or write to=NAME.trc"
        )
    if config.angles and out.suffix.lower() not in (".csv", ".mot"):
        raise InputError("angles=true: only .csv and .mot hold angles; leave it out, or write to=NAME.csv")
    motion = _read_motion(config, source)
    beside = [out.with_suffix(ending) for ending in endings_beside(out.suffix.lower(), motion)]
    beside = [path for path in beside if not _is_there(motion, path)]
    for path in beside:
        free_path("to", path, config.overwrite)
    if write_points is not None:
        write_points(out, motion, config.up or motion.up, config.markers)
    elif config.angles and out.suffix.lower() == ".csv":
        write_angles_csv(out, motion, config.up or motion.up)
    elif out.suffix.lower() == ".motion":
        write_skeletool_motion(out, motion, _actor(config, out))
    else:
        said = export_motion(motion, out, config.up, config.dialect)
        if said is not None:
            print(said)
    for path in beside:
        export_motion(motion, path)
        print(path)


def _is_there(motion: Motion, path: Path) -> bool:
    """Whether a file holds already what would be written."""
    if not path.is_file():
        return False
    with TemporaryDirectory() as folder:
        export_motion(motion, Path(folder) / path.name)
        return (Path(folder) / path.name).read_bytes() == path.read_bytes()


def _read_motion(config: ExportConfig, path: Path) -> Motion:
    if path.suffix.lower() != ".motion":
        return load_one_motion(path)
    if config.fps is None or config.fps <= 0:
        raise InputError(f"{path}: does not say its frame rate; add fps=..., a number over 0")
    up = config.up or DEFAULT_UP
    actor = _actor(config, path)
    turned = actor.rotated(jnp.asarray(world_from_upright(up), actor.blob_sigmas.dtype))
    return read_skeletool_motion(path, turned, config.fps, up)


def _actor(config: ExportConfig, path: Path) -> Body:
    if config.actor is None:
        raise InputError(f"{path}: does not say which joints it moves; add actor=..., its actor or body file")
    return body_named(config.actor)
