"""What stands and moves in the world of a Rerun file: cameras, actors, markers."""

import numpy as np
import rerun as rr

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.quality.limb_warnings import in_doubt
from sogjax.view.bones import Bones, actor_palette
from sogjax.view.projection import PictureCamera
from sogjax.view.rerun.stream import FRAME, TIME, camera_entity, time_columns

LARGEST_DOUBT = 0.06
"""Metres: the radius of the balls around the joints of a limb that is certainly lost."""


def log_cameras(
    stream: rr.RecordingStream, recording: Recording, cameras: list[PictureCamera], middle: np.ndarray
) -> None:
    """The cameras where they stand, with their lenses, drawn at a size that suits their distance."""
    axis, direction = recording.up[-1].upper(), "DOWN" if recording.up.startswith("-") else "UP"
    stream.log("/world", getattr(rr.ViewCoordinates, f"RIGHT_HAND_{axis}_{direction}"), static=True)
    for camera in cameras:
        pose = camera.world_from_camera
        placed = rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
        lens = rr.Pinhole(
            image_from_camera=camera.intrinsics,
            resolution=camera.size,
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=0.12 * float(np.linalg.norm(pose[:3, 3] - middle)),
        )
        stream.log(camera_entity(camera.name), placed, lens, static=True)


def log_look(
    stream: rr.RecordingStream,
    entity: str,
    motion: Motion,
    bones: Bones,
    actor: int,
    colors: np.ndarray,
    static: bool = False,
) -> None:
    """What does not change about an actor: colours, widths, sizes of its blobs.

    Blobs are only static where the motion's frames are not on the timelines: else they would stand there before it.
    """
    if len(bones.edges):
        look = {"colors": actor_palette(actor)[bones.sides], "radii": [0.008]}
        stream.log(f"{entity}/skeleton", rr.LineStrips3D.from_fields(**look), static=True)
    sizes = np.repeat(motion.blob_sigma.astype(np.float32)[:, None], 3, axis=1)
    solid = rr.components.FillMode.Solid
    look = {"half_sizes": sizes, "colors": colors, "fill_mode": solid}
    stream.set_time(FRAME, sequence=int(motion.frame[0]))
    stream.set_time(TIME, duration=float(motion.time[0]))
    stream.log(f"{entity}/blobs", rr.Ellipsoids3D.from_fields(**look), static=static)
    stream.reset_time()


def log_actor(stream: rr.RecordingStream, entity: str, motion: Motion, bones: Bones) -> np.ndarray:
    """The frames of a body; returns the path of its root."""
    log_skeletons(stream, entity, motion, bones, time_columns(motion))
    return bones.points(motion)[:, 0] if bones.num_joints else motion.blob_means.mean(axis=1)


def log_skeletons(
    stream: rr.RecordingStream, entity: str, motion: Motion, bones: Bones, times: list[rr.TimeColumn]
) -> None:
    """Lines and blobs of every frame, at times that need not be the motion's own."""
    points = bones.points(motion)
    num_frames, num_edges = len(points), len(bones.edges)
    if num_edges:
        strips = points[:, bones.edges].reshape(-1, 2, 3)
        columns = rr.LineStrips3D.columns(strips=strips).partition([num_edges] * num_frames)
        stream.send_columns(f"{entity}/skeleton", times, columns)
    centers = motion.blob_means.reshape(-1, 3).astype(np.float32)
    columns = rr.Ellipsoids3D.columns(centers=centers).partition([len(motion.blob_sigma)] * num_frames)
    stream.send_columns(f"{entity}/blobs", times, columns)


def log_doubts(stream: rr.RecordingStream, entity: str, motion: Motion, bones: Bones) -> None:
    """White balls around the joints of limbs that are in doubt, the larger the doubt, where limbs were judged."""
    if motion.limb_doubt is None or motion.joint_limb is None or not motion.limb_doubt.shape[1]:
        return
    limb = motion.joint_limb[bones.joints]
    doubtful = in_doubt(motion)[:, limb] & (limb >= 0)
    places = motion.world_from_joint[:, bones.joints][..., :3, 3].astype(np.float32)
    radii = (LARGEST_DOUBT * motion.limb_doubt[:, limb]).astype(np.float32)
    colors = [[255, 255, 255, 110]] * int(doubtful.sum())
    columns = rr.Points3D.columns(positions=places[doubtful], radii=radii[doubtful], colors=colors)
    stream.send_columns(f"{entity}/doubtful", time_columns(motion), columns.partition(doubtful.sum(axis=1)))


def log_path(stream: rr.RecordingStream, entity: str, path: np.ndarray, actor: int) -> None:
    """The path of an actor's root through all frames."""
    trail = rr.LineStrips3D([path], colors=[actor_palette(actor)[1]], radii=[0.004])
    stream.log(f"{entity}/path", trail, static=True)


def log_markers(stream: rr.RecordingStream, truth: GroundTruth, frames: tuple[int, int]) -> None:
    """True markers over [first, stop) of the frames."""
    markers = truth.markers
    assert markers is not None
    first, stop = frames
    shown = np.arange(first, min(stop, len(markers)))
    present = [points[np.isfinite(points).all(axis=1)] for points in markers[shown]]
    look = rr.Points3D.from_fields(colors=[[255, 255, 255]], radii=[0.01])
    stream.log("/world/truth/markers", look, static=True)
    times = [
        rr.TimeColumn(FRAME, sequence=shown),
        rr.TimeColumn(TIME, duration=shown / float(truth.fps)),
    ]
    points = rr.Points3D.columns(positions=np.concatenate(present).astype(np.float32))
    lengths = [len(part) for part in present]
    stream.send_columns("/world/truth/markers", times, points.partition(lengths))
