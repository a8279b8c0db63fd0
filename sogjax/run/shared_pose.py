"""One initial pose for the members of a sweep: they are to measure a setting, not the luck of a search."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sogjax.run.initial_pose import (
    InitialPose,
    PoseRequest,
    PoseSource,
    from_example_frames,
    from_file,
    from_keypoints,
    from_search,
)
from sogjax.run.shared import SHARED
from sogjax.run.terminal import say
from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig, SolverConfig, TrackingConfig
from sogjax.settings.run import TrackConfig

OWN = ("recording", "cameras", "actor", "actors", "body", "initial_pose", "start", "stop")
"""Settings with which an initial pose is another one, beside the colour space and the background."""


def of_initial_pose(config: TrackConfig) -> Mapping[str, Any]:
    """The settings of a run that its initial pose depends on, where it is searched for as for a sweep."""
    own = {name: getattr(config, name) for name in OWN}
    return own | {"color.space": config.color.space, "images.background": config.images.background}


def shared_pose(request: PoseRequest) -> InitialPose | None:
    """The pose of keypoints or of a search with the usual energy, made once for all that have the same settings.

    So it depends on neither the order of the runs nor their processes.

    Raises:
        InputError: the actors are not found in the pictures.
    """

    def found() -> InitialPose | None:
        say("the initial pose is searched for once, with the usual energy, for all members that see the same")
        usual = replace(request, config=_usual(request.config), terms=())
        return from_keypoints(usual) or from_search(usual)

    return SHARED.get(f"initial pose {of_initial_pose(request.config)!r}", found)


SWEEP_SOURCES: tuple[PoseSource, ...] = (from_file, from_example_frames, shared_pose)
"""The sources of initial poses for members of a sweep."""


def _usual(config: TrackConfig) -> TrackConfig:
    """The settings with the usual method, but for what decides what is seen."""
    return replace(
        config,
        color=ColorConfig(space=config.color.space),
        images=ImagesConfig(background=config.images.background, cache=config.images.cache),
        energy=EnergyConfig(),
        solver=SolverConfig(),
        tracking=TrackingConfig(),
    )
