"""Several runs of one recording, or a solver's iterations in one of its frames, in one Rerun file."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import rerun as rr
from jaxtyping import Float

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.view.bones import blob_palette, bones_from_motion
from sogjax.view.projection import frame_range
from sogjax.view.rerun.curves import log_body_curve_looks, log_curves, own_curves, plots_with
from sogjax.view.rerun.layout import comparison_layout, iterations_layout
from sogjax.view.rerun.scene import Scene, log_body, log_look
from sogjax.view.rerun.stream import ITERATION, rerun_stream, run_entity


def write_comparison(
    path: Path,
    recording: Recording,
    runs: Mapping[str, Sequence[Motion]],
    *,
    errors: Mapping[str, Float[np.ndarray, "frame"]] | None = None,
    frames: Iterable[Sequence[np.ndarray]] | None = None,
    truth: GroundTruth | None = None,
) -> None:
    """Write runs of one recording, such as those of a sweep or of several solvers, side by side.

    A run's actors lie under `/world/runs/RUN`, its curves, in its bodies' colours, beside those of the others in common
    plots.

    Args:
        path: the `.rrd` file, replaced as a whole.
        recording: what was tracked.
        runs: by name, the motions of the actors.
        errors: mean distance to the truth over the frames of each run's first motion, metres.
        frames: BGR pictures of all cameras from the first frame of all runs to the last; None: no pictures.
        truth: markers to show beside the bodies.
    """
    motions = [motion for actors in runs.values() for motion in actors]
    first, stop = frame_range(recording, motions)
    plots = plots_with([*own_curves(motions[0]), *(["error_mm"] if errors else [])])
    with rerun_stream(path, f"{recording.name}: {len(runs)} runs") as stream:
        scene = Scene(stream, recording, picture_width=480)
        for number, (name, actors) in enumerate(runs.items()):
            _log_run(scene, name, actors, number, (errors or {}).get(name))
        scene.log_cameras()
        for frame, pictures in enumerate(frames or (), first):
            scene.set_frame(frame)
            scene.log_pictures([camera.jpeg(image) for camera, image in zip(scene.cameras, pictures, strict=True)])
        stream.reset_time()
        scene.log_markers(truth, first, stop)
        stream.send_blueprint(comparison_layout(recording, list(runs), plots, scene.eye(), frames is not None))


def _log_run(scene: Scene, name: str, actors: Sequence[Motion], number: int, errors: np.ndarray | None) -> None:
    """Log the bodies and curves of one run."""
    for k, motion in enumerate(actors):
        entity, bones = f"{run_entity(name)}/actor_{k + 1}", bones_from_motion(motion)
        log_look(scene.stream, entity, motion, bones, number, blob_palette(motion, number))
        log_body(scene.stream, entity, motion, bones)
        scene.extend(motion.blob_means)
    curves = own_curves(actors[0]) | ({} if errors is None else {"error_mm": 1000.0 * errors})
    log_body_curve_looks(scene.stream, name, curves, number)
    log_curves(scene.stream, actors[0], name, curves)


def write_iterations(
    path: Path,
    recording: Recording,
    steps: Motion,
    energies: Float[np.ndarray, "iteration"],
    pictures: list[np.ndarray] | None = None,
) -> None:
    """Write the poses that a solver went through in one frame; the path of every joint is drawn as a line.

    Args:
        path: the `.rrd` file, replaced as a whole.
        recording: what was tracked.
        steps: a motion whose frames are the iterations, the first of them the start.
        energies: after each iteration.
        pictures: BGR, of all cameras in that frame; None: without pictures.
    """
    with rerun_stream(path, f"{recording.name}: iterations of one frame") as stream:
        scene = Scene(stream, recording, picture_width=640)
        scene.extend(steps.blob_means[-1])
        scene.log_cameras()
        scene.log_pictures(
            [camera.jpeg(image) for camera, image in zip(scene.cameras, pictures or [], strict=False)], static=True
        )
        bones = bones_from_motion(steps)
        times = [rr.TimeColumn(ITERATION, sequence=np.arange(steps.num_frames))]
        log_look(stream, "/world/iterations", steps, bones, 0, blob_palette(steps, 0), static=True)
        log_body(stream, "/world/iterations", steps, bones, times)
        ways = np.swapaxes(steps.world_from_joint[:, bones.joints][..., :3, 3], 0, 1)
        stream.log("/world/iterations/ways", rr.LineStrips3D(ways, colors=[[255, 220, 90]], radii=[0.002]), static=True)
        stream.log("/curves/energy/energy", rr.SeriesLines(names="energy"), static=True)
        stream.send_columns("/curves/energy/energy", times, rr.Scalars.columns(scalars=np.asarray(energies, float)))
        stream.send_blueprint(iterations_layout(recording, scene.eye(), bool(pictures)))
