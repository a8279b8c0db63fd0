"""Blueprints of Rerun files: what is shown where when a file is opened."""

from collections.abc import Mapping, Sequence

import rerun.blueprint as rrb

from sogjax.io.recording import Recording
from sogjax.view.rerun.stream import FRAME, ITERATION, actor_entity, camera_entity, run_entity

CAMERAS_SHOWN = 4
"""More pictures beside the scene would be too small."""


def tracking_layout(
    recording: Recording, names: Sequence[str], with_blobs: bool, plots: Mapping[str, str], eye: rrb.EyeControls3D
) -> rrb.Blueprint:
    """A large 3-D view, a few cameras beside it, the curves below."""
    skeletons = [f"{actor_entity(name)}/skeleton" for name in names]
    views = []
    for name in _spread(recording.rig.names, CAMERAS_SHOWN // 2 if with_blobs else CAMERAS_SHOWN):
        origin = camera_entity(name)
        views.append(rrb.Spatial2DView(origin=origin, contents=["$origin/picture", *skeletons], name=name))
        if with_blobs:
            contents = ["$origin/blobs", *skeletons]
            views.append(rrb.Spatial2DView(origin=origin, contents=contents, name=f"{name} blobs"))
    scene = rrb.Spatial3DView(origin="/world", name="Scene", eye_controls=eye)
    top = rrb.Horizontal(scene, rrb.Grid(*views, grid_columns=2), column_shares=[1, 1])
    return _blueprint(top, _plots(plots), FRAME, recording.fps)


def comparison_layout(
    recording: Recording, runs: Sequence[str], plots: Mapping[str, str], eye: rrb.EyeControls3D, with_pictures: bool
) -> rrb.Blueprint:
    """A scene for each run, side by side, one camera below each, and the curves of all runs in common plots."""
    camera = camera_entity(recording.rig.names[0])
    columns = []
    for run in runs:
        own = f"{run_entity(run)}/**"
        contents = [own, "/world/truth/**"]
        views: list[rrb.View] = [rrb.Spatial3DView(origin="/world", contents=contents, name=run, eye_controls=eye)]
        if with_pictures:
            views.append(rrb.Spatial2DView(origin=camera, contents=["$origin/picture", own], name=run))
        columns.append(rrb.Vertical(*views))
    return _blueprint(rrb.Horizontal(*columns), _plots(plots), FRAME, recording.fps)


def iterations_layout(recording: Recording, eye: rrb.EyeControls3D, with_pictures: bool) -> rrb.Blueprint:
    """The scene, a few cameras beside it, the energy below; the timeline counts iterations."""
    views = [
        rrb.Spatial2DView(origin=camera_entity(name), contents=["$origin/picture", "/world/iterations/**"], name=name)
        for name in _spread(recording.rig.names, CAMERAS_SHOWN if with_pictures else 0)
    ]
    scene = rrb.Spatial3DView(origin="/world", name="Iterations", eye_controls=eye)
    top = rrb.Horizontal(scene, rrb.Grid(*views, grid_columns=2)) if views else scene
    return _blueprint(top, rrb.TimeSeriesView(origin="/curves/energy", name="Energy"), ITERATION)


def live_layout(plots: Mapping[str, str], eye: rrb.EyeControls3D) -> rrb.Blueprint:
    """The scene as it comes, the curves below."""
    scene = rrb.Spatial3DView(origin="/world", name="Scene", eye_controls=eye)
    return rrb.Blueprint(
        rrb.Vertical(scene, _plots(plots), row_shares=[3, 1]),
        rrb.TimePanel(state="collapsed", timeline=FRAME),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def _plots(plots: Mapping[str, str]) -> rrb.Horizontal:
    """Plots with their titles, side by side."""
    return rrb.Horizontal(*(rrb.TimeSeriesView(origin=f"/curves/{plot}", name=title) for plot, title in plots.items()))


def _blueprint(
    top: rrb.Container | rrb.View, curves: rrb.Container | rrb.View, timeline: str, fps: float | None = None
) -> rrb.Blueprint:
    """Curves below what is larger, and a timeline that runs on and on."""
    return rrb.Blueprint(
        rrb.Vertical(top, curves, row_shares=[3, 1]),
        rrb.TimePanel(state="collapsed", timeline=timeline, fps=fps, loop_mode="All"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def _spread(names: Sequence[str], count: int) -> list[str]:
    """At most `count` of the names, evenly taken from the list."""
    count = min(count, len(names))
    return [names[k * len(names) // count] for k in range(count)]
