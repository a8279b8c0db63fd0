"""`sogjax body`: a body file from the skeleton of another program."""

from pathlib import Path

from sogjax.cli.config.schemas import BodyConfig
from sogjax.errors import InputError, counted
from sogjax.io.actor_file import save_body
from sogjax.io.calibration.rig import METRES
from sogjax.io.skeletons.load import read_skeleton
from sogjax.model.rotation import UP_AXES
from sogjax.run.outputs import free_path


def run(config: BodyConfig) -> Path:
    """Read the skeleton, attach blobs if it has none, and write the body file.

    Raises:
        InputError: an invalid file or option, or a body file that already exists.
    """
    if config.up not in UP_AXES:
        raise InputError(f"up={config.up}: must be one of {', '.join(UP_AXES)}")
    if config.unit not in (None, *METRES):
        raise InputError(f"unit={config.unit}: must be one of {', '.join(METRES)}")
    out = free_path("out", config.out, config.overwrite)
    dof = None if config.dof is None else Path(config.dof)
    body = read_skeleton(Path(config.from_), dof, config.unit, config.up)
    save_body(out, body)
    skeleton = body.skeleton
    dofs = counted(skeleton.num_dofs, "degree of freedom", "degrees of freedom")
    print(f"{counted(skeleton.num_joints, 'joint')}, {dofs}, {counted(body.num_blobs, 'blob')}")
    print(out)
    return out
