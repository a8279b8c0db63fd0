"""One first pose for the members of a sweep: they are to measure a setting, not the luck of a search."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.first_pose import first_poses, initial_pose_file
from sogjax.run.job import frame_range
from sogjax.run.recordings import upright
from sogjax.run.terminal import say
from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig, SolverConfig, TrackingConfig
from sogjax.settings.run import TrackConfig

OWN = ("recording", "cameras", "actor", "actors", "body", "initial_pose", "start", "stop")
"""Settings with which a first pose is another one, beside the colour space and the background."""

_found: dict[str, Float[Array, "dof"]] = {}


def of_first_pose(config: TrackConfig) -> Mapping[str, Any]:
    """The settings of a run that its first pose depends on, where it is searched for as for a sweep."""
    own = {name: getattr(config, name) for name in OWN}
    return own | {"color.space": config.color.space, "images.background": config.images.background}


def shared_opening(
    recording: Recording, bodies: Sequence[Body], config: TrackConfig
) -> tuple[Float[Array, "dof"], int] | None:
    """The first pose and its frame, searched for once for all runs with the same `of_first_pose`, until forgotten.

    It is searched for with the usual energy, so that it depends on neither the order of the runs nor their processes.
    `bodies` are in their own upright frames. None: a file gives the pose, so nothing is searched for.

    Raises:
        InputError: the actors are not found in the pictures.
    """
    if initial_pose_file(recording, config) is not None:
        return None
    first, _ = frame_range(recording, config)
    key = repr(of_first_pose(config))
    if key not in _found:
        say("the first pose is searched for once, with the usual energy, for all members that see the same")
        standing = [upright(body, recording) for body in bodies]
        _found[key] = jnp.concatenate(first_poses(recording, standing, _usual(config), first))
    return _found[key], first


def forget_shared_openings() -> None:
    """Forget first poses: actor files and recordings may change between sweeps."""
    _found.clear()


def _usual(config: TrackConfig) -> TrackConfig:
    return replace(
        config,
        color=ColorConfig(space=config.color.space),
        images=ImagesConfig(background=config.images.background, cache=config.images.cache),
        energy=EnergyConfig(),
        solver=SolverConfig(),
        tracking=TrackingConfig(),
    )
