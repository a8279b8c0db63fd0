"""The path of a solver through one frame, iteration by iteration, on a timeline of its own."""

from pathlib import Path

import numpy as np
import rerun as rr
from jaxtyping import Float

from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.view.bones import blob_palette, bones_from_motion
from sogjax.view.projection import picture_camera
from sogjax.view.rerun.layout import eye, iterations_layout
from sogjax.view.rerun.scene import log_cameras, log_look, log_skeletons
from sogjax.view.rerun.stream import ITERATION, camera_entity, rerun_stream


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
    with rerun_stream(Path(path), f"{recording.name}: iterations of one frame") as stream:
        _write(stream, recording, steps, energies, pictures or [])


def _write(
    stream: rr.RecordingStream,
    recording: Recording,
    steps: Motion,
    energies: np.ndarray,
    pictures: list[np.ndarray],
) -> None:
    cameras = [picture_camera(recording.rig, name, 640) for name in recording.rig.names]
    middle = steps.blob_means[-1].mean(axis=0)
    log_cameras(stream, recording, cameras, middle)
    for camera, picture in zip(cameras, pictures, strict=False):
        jpeg = rr.EncodedImage(contents=camera.jpeg(picture, 80), media_type="image/jpeg")
        stream.log(f"{camera_entity(camera.name)}/picture", jpeg, static=True)
    bones = bones_from_motion(steps)
    times = [rr.TimeColumn(ITERATION, sequence=np.arange(steps.num_frames))]
    log_look(stream, "/world/iterations", steps, bones, 0, blob_palette(steps, 0), static=True)
    log_skeletons(stream, "/world/iterations", steps, bones, times)
    ways = np.swapaxes(steps.world_from_joint[:, bones.joints][..., :3, 3], 0, 1)
    stream.log("/world/iterations/ways", rr.LineStrips3D(ways, colors=[[255, 220, 90]], radii=[0.002]), static=True)
    stream.log("/curves/energy/energy", rr.SeriesLines(names="energy"), static=True)
    stream.send_columns("/curves/energy/energy", times, rr.Scalars.columns(scalars=np.asarray(energies, float)))
    size = float(np.linalg.norm(np.ptp(steps.blob_means[-1], axis=0)))
    stream.send_blueprint(iterations_layout(recording, eye(recording, middle, size), bool(pictures)))
