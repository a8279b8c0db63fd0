"""Several runs of one recording side by side in one Rerun file: each is an entity tree of its own."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import rerun as rr
from jaxtyping import Float

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.view.bones import blob_palette, bones_from_motion
from sogjax.view.projection import PictureCamera, frame_range, picture_camera
from sogjax.view.rerun.curves import log_body_curve_looks, log_curves, own_curves, plots_with
from sogjax.view.rerun.layout import comparison_layout, eye
from sogjax.view.rerun.scene import log_actor, log_cameras, log_look, log_markers
from sogjax.view.rerun.stream import FRAME, TIME, camera_entity, rerun_stream, run_entity

PICTURE_WIDTH = 480


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
    with rerun_stream(Path(path), f"{recording.name}: {len(runs)} runs") as stream:
        _write(stream, recording, runs, errors or {}, frames, truth)


def _write(
    stream: rr.RecordingStream,
    recording: Recording,
    runs: Mapping[str, Sequence[Motion]],
    errors: Mapping[str, np.ndarray],
    frames: Iterable[Sequence[np.ndarray]] | None,
    truth: GroundTruth | None,
) -> None:
    motions = [motion for actors in runs.values() for motion in actors]
    first, stop = frame_range(recording, motions)
    cameras = [picture_camera(recording.rig, name, PICTURE_WIDTH) for name in recording.rig.names]
    lowest = np.min([motion.blob_means.min(axis=(0, 1)) for motion in motions], axis=0)
    highest = np.max([motion.blob_means.max(axis=(0, 1)) for motion in motions], axis=0)
    middle = 0.5 * (lowest + highest)
    log_cameras(stream, recording, cameras, middle)
    for k, (name, actors) in enumerate(runs.items()):
        _log_run(stream, name, actors, k, errors.get(name))
    if frames is not None:
        _log_pictures(stream, recording, cameras, frames, first)
    if truth is not None and truth.markers is not None:
        log_markers(stream, truth, (first, stop))
    curves = [*own_curves(motions[0]), *(["error_mm"] if errors else [])]
    view = eye(recording, middle, float(np.linalg.norm(highest - lowest)))
    stream.send_blueprint(comparison_layout(recording, list(runs), plots_with(curves), view, frames is not None))


def _log_run(
    stream: rr.RecordingStream, name: str, actors: Sequence[Motion], number: int, errors: np.ndarray | None
) -> None:
    """The bodies and curves of one run."""
    for k, motion in enumerate(actors):
        entity, bones = f"{run_entity(name)}/actor_{k + 1}", bones_from_motion(motion)
        log_look(stream, entity, motion, bones, number, blob_palette(motion, number))
        log_actor(stream, entity, motion, bones)
    curves = own_curves(actors[0]) | ({} if errors is None else {"error_mm": 1000.0 * errors})
    log_body_curve_looks(stream, name, curves, number)
    log_curves(stream, actors[0], name, curves)


def _log_pictures(
    stream: rr.RecordingStream,
    recording: Recording,
    cameras: Sequence[PictureCamera],
    frames: Iterable[Sequence[np.ndarray]],
    first: int,
) -> None:
    for number, pictures in enumerate(frames, first):
        stream.set_time(FRAME, sequence=number)
        stream.set_time(TIME, duration=number / recording.fps)
        for camera, picture in zip(cameras, pictures, strict=True):
            jpeg = rr.EncodedImage(contents=camera.jpeg(picture, 75), media_type="image/jpeg")
            stream.log(f"{camera_entity(camera.name)}/picture", jpeg)
    stream.reset_time()
