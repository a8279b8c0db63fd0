"""The poses of the actors in the first frame of a track: from a file, or searched for."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt8

from sogjax.data.initial_pose import load_initial_poses
from sogjax.data.recording import Recording
from sogjax.data.video import read_frames
from sogjax.energy import Term
from sogjax.engine import build
from sogjax.engine.terminal import say
from sogjax.errors import InputError
from sogjax.images.cells import stack_cells
from sogjax.model.body import Body
from sogjax.settings import TrackConfig
from sogjax.tracking.frame_views import FrameViews, levels
from sogjax.tracking.initial_pose import rough_pose
from sogjax.tracking.pose_search import FoundPose, search_poses

AUTO = "auto"
SURE = 0.005
"""A margin below this gets a warning."""


def initial_pose_file(recording: Recording, config: TrackConfig) -> Path | None:
    """The file with rough poses; None: they are searched for.

    Raises:
        InputError: the requested file does not exist.
    """
    if config.initial_pose == AUTO:
        return None
    if config.initial_pose is None:
        return recording.initial_poses
    path = Path(config.initial_pose)
    if not path.is_file():
        raise InputError(f"initial_pose={config.initial_pose}: there is no such file; give one, or initial_pose=auto")
    return path


def first_poses(
    recording: Recording, bodies: Sequence[Body], config: TrackConfig, frame: int, terms: Sequence[Term] = ()
) -> list[Float[Array, "dof"]]:
    """The poses of bodies, upright in the recording's world, in a frame counted from the recording's first.

    Raises:
        InputError: the file is invalid, or an actor is not found in the pictures.
    """
    path = initial_pose_file(recording, config)
    if path is None:
        found = searched_poses(recording, bodies, config, frame, terms)
        for body, pose in zip(bodies, found, strict=True):
            say(f"first pose of {body.name} found; the next different one is {100.0 * pose.margin:.1f} % worse")
            if pose.margin < SURE:
                say(f"warning: uncertain; check the first frame of the overlay, or write {_remedy(recording)}")
        return [pose.pose for pose in found]
    if frame + recording.first_frame > 0:
        say(f"warning: the rough pose of {path} is used for frame {frame + recording.first_frame}")
    descriptions = load_initial_poses(path, [body.name for body in bodies])
    poses = []
    for body in bodies:
        try:
            poses.append(rough_pose(body, descriptions[body.name], recording.up))
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
    return poses


def searched_poses(
    recording: Recording, bodies: Sequence[Body], config: TrackConfig, frame: int, terms: Sequence[Term] = ()
) -> list[FoundPose]:
    """The poses that fit the pictures of a frame best, in the order of the bodies.

    Raises:
        InputError: the pictures show nothing in an actor's colours where the cameras look.
    """
    recording, pictures = _seen(recording, frame)
    depths = levels(config.images.depth)
    grids = [build.cell_grids(recording, depth) for depth in depths]
    views = FrameViews(
        build.device_cameras(recording),
        tuple(build.image_reader(recording, grid, config) for grid in grids),
        tuple(jnp.asarray(stack_cells(pictures, grid)) for grid in grids),
    )
    found = search_poses(bodies, views, build.energy_terms(config.energy, terms), recording.up)
    lost = [body.name for body, pose in zip(bodies, found, strict=True) if not pose.energy > 0.0]
    if lost:
        raise InputError(
            f"{recording.path}: nothing like {', '.join(lost)} is seen in frame {frame + recording.first_frame}; "
            f"write {_remedy(recording)}, or begin with another frame (start=)"
        )
    return found


def _seen(recording: Recording, frame: int) -> tuple[Recording, list[UInt8[np.ndarray, "_h _w 3"]]]:
    """The recording with the cameras that have a frame, and their pictures of it."""
    pictures = dict(zip(recording.rig.names, next(iter(read_frames(recording, frame, frame + 1))), strict=True))
    present = {name: picture for name, picture in pictures.items() if picture is not None}
    if not present:
        raise InputError(f"{recording.path}: no camera has frame {frame + recording.first_frame}; begin later (start=)")
    if len(present) == len(pictures):
        return recording, list(present.values())
    return replace(recording, rig=recording.rig.select(tuple(present))), list(present.values())


def _remedy(recording: Recording) -> str:
    return f"the rough pose into {recording.path / 'initial_pose.yaml'}"
