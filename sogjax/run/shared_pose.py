"""One initial pose for the members of a sweep: they are to measure a setting, not the luck of a search."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Any

from sogjax.run.initial_pose import SOURCES, InitialPose, PoseRequest, PoseSource, from_example_frames, from_file
from sogjax.run.shared import SHARED
from sogjax.run.terminal import say
from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig, SolverConfig, TrackingConfig
from sogjax.settings.option import telling_settings
from sogjax.settings.run import OutputsConfig, TrackConfig

KNOWN = (from_file, from_example_frames)
"""Sources that look at no pictures: each member asks them itself."""


def of_initial_pose(config: TrackConfig) -> Mapping[str, Any]:
    """The settings of a run that its initial pose depends on, where it is searched for as for a sweep."""
    return telling_settings(_usual(config))


def shared(sources: Sequence[PoseSource]) -> PoseSource:
    """The pose of the first source that tells one, with the usual energy; made once for all with the same settings.

    So it depends on neither the order of the runs nor their processes.
    """
    names = ", ".join(source.__name__ for source in sources)

    def shared_pose(request: PoseRequest) -> InitialPose | None:
        def found() -> InitialPose | None:
            say("the initial pose is searched for once, with the usual energy, for all members that see the same")
            usual = replace(request, config=_usual(request.config), terms=())
            return next((pose for source in sources if (pose := source(usual)) is not None), None)

        return SHARED.get(f"initial pose {names} {of_initial_pose(request.config)!r}", found)

    return shared_pose


SWEEP_SOURCES: tuple[PoseSource, ...] = tuple(
    source
    for are_known, of_kind in groupby(SOURCES, KNOWN.__contains__)
    for source in (of_kind if are_known else [shared([*of_kind])])
)
"""The sources of initial poses for members of a sweep, in their order."""


def _usual(config: TrackConfig) -> TrackConfig:
    """The settings with the usual method and outputs, but for what decides what is seen."""
    return replace(
        config,
        adjust=False,
        outputs=OutputsConfig(),
        color=ColorConfig(space=config.color.space),
        images=ImagesConfig(background=config.images.background, cache=config.images.cache),
        energy=EnergyConfig(),
        solver=SolverConfig(),
        tracking=TrackingConfig(),
    )
