"""Blueprints of Rerun files: what is shown where when a file is opened."""

from collections.abc import Sequence

import numpy as np
import rerun.blueprint as rrb

from sogjax.io.recording import Recording
from sogjax.model.rotation import world_from_upright
from sogjax.view.rerun.stream import FRAME, ITERATION, actor_entity, camera_entity, run_entity

CAMERAS_SHOWN = 4


def tracking_layout(
    recording: Recording, names: Sequence[str], with_blobs: bool, plots: dict[str, str], eye: rrb.EyeControls3D
) -> rrb.Blueprint:
    """A large 3-D view, a few cameras beside it, the curves below."""
    shown = spread(recording.rig.names, CAMERAS_SHOWN // 2 if with_blobs else CAMERAS_SHOWN)
    skeletons = [f"{actor_entity(name)}/skeleton" for name in names]
    views = []
    for name in shown:
        origin = camera_entity(name)
        views.append(rrb.Spatial2DView(origin=origin, contents=["$origin/picture", *skeletons], name=name))
        if with_blobs:
            contents = ["$origin/blobs", *skeletons]
            views.append(rrb.Spatial2DView(origin=origin, contents=contents, name=f"{name} blobs"))
    curves = [rrb.TimeSeriesView(origin=f"/curves/{plot}", name=title) for plot, title in plots.items()]
    scene = rrb.Spatial3DView(origin="/world", name="Scene", eye_controls=eye)
    top = rrb.Horizontal(scene, rrb.Grid(*views, grid_columns=2), column_shares=[1, 1])
    return rrb.Blueprint(
        rrb.Vertical(top, rrb.Horizontal(*curves), row_shares=[3, 1]),
        rrb.TimePanel(state="collapsed", timeline=FRAME, fps=recording.fps, loop_mode="All"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def comparison_layout(
    recording: Recording,
    runs: Sequence[str],
    plots: dict[str, str],
    eye: rrb.EyeControls3D,
    with_pictures: bool,
) -> rrb.Blueprint:
    """A scene for each run, side by side, one camera below each, and the curves of all runs in common plots."""
    camera = camera_entity(recording.rig.names[0])
    columns = []
    for run in runs:
        own = f"{run_entity(run)}/**"
        contents = [own, "/world/truth/**"]
        scene = rrb.Spatial3DView(origin="/world", contents=contents, name=run, eye_controls=eye)
        views: list[rrb.Spatial3DView | rrb.Spatial2DView] = [scene]
        if with_pictures:
            views.append(rrb.Spatial2DView(origin=camera, contents=["$origin/picture", own], name=run))
        columns.append(rrb.Vertical(*views))
    curves = [rrb.TimeSeriesView(origin=f"/curves/{plot}", name=title) for plot, title in plots.items()]
    return rrb.Blueprint(
        rrb.Vertical(rrb.Horizontal(*columns), rrb.Horizontal(*curves), row_shares=[3, 1]),
        rrb.TimePanel(state="collapsed", timeline=FRAME, fps=recording.fps, loop_mode="All"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def iterations_layout(recording: Recording, eye: rrb.EyeControls3D, with_pictures: bool) -> rrb.Blueprint:
    """The scene, a few cameras beside it, the energy below; the timeline counts iterations."""
    views = [
        rrb.Spatial2DView(origin=camera_entity(name), contents=["$origin/picture", "/world/iterations/**"], name=name)
        for name in spread(recording.rig.names, CAMERAS_SHOWN if with_pictures else 0)
    ]
    scene = rrb.Spatial3DView(origin="/world", name="Iterations", eye_controls=eye)
    top = rrb.Horizontal(scene, rrb.Grid(*views, grid_columns=2)) if views else scene
    energy = rrb.TimeSeriesView(origin="/curves/energy", name="Energy")
    return rrb.Blueprint(
        rrb.Vertical(top, energy, row_shares=[3, 1]),
        rrb.TimePanel(state="collapsed", timeline=ITERATION, loop_mode="All"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
    )


def eye(recording: Recording, middle: np.ndarray, size: float) -> rrb.EyeControls3D:
    """Look at the middle of what moves, from the front left and a little above."""
    upright = world_from_upright(recording.up)
    position = middle + size * upright @ np.array([1.0, 0.8, 0.5])
    return rrb.EyeControls3D(position=position, look_target=middle, eye_up=upright[:, 2])


def spread(names: Sequence[str], count: int) -> list[str]:
    """At most `count` of the names, evenly taken from the list."""
    count = min(count, len(names))
    return [names[k * len(names) // count] for k in range(count)]
