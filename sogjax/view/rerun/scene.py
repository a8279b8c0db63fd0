"""What stands and moves in the world of a Rerun file: cameras with their pictures, bodies, markers."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.rotation import world_from_upright
from sogjax.quality.limb_warnings import in_doubt
from sogjax.view.bones import Bones, actor_palette
from sogjax.view.projection import picture_camera
from sogjax.view.rerun.stream import FRAME, TIME, camera_entity, time_columns


class Scene:
    """The cameras of a recording, and the space that what moves before them takes up.

    Args:
        stream: into the file.
        recording: what was tracked.
        picture_width: largest width of the stored pictures in pixels.
    """

    def __init__(self, stream: rr.RecordingStream, recording: Recording, picture_width: int) -> None:
        self.stream, self.recording = stream, recording
        self.cameras = [picture_camera(recording.rig, name, picture_width) for name in recording.rig.names]
        self._lowest, self._highest = np.full(3, np.inf), np.full(3, -np.inf)

    def extend(self, points: Float[np.ndarray, "*n 3"]) -> None:
        """Note that points (metres, world) are to be seen when the file is opened."""
        flat = points.reshape(-1, 3)
        self._lowest = np.minimum(self._lowest, flat.min(axis=0))
        self._highest = np.maximum(self._highest, flat.max(axis=0))

    @property
    def _middle(self) -> Float[np.ndarray, "3"]:
        return 0.5 * (self._lowest + self._highest)

    def eye(self) -> rrb.EyeControls3D:
        """Look at the middle of what moves, from the front left and a little above."""
        upright = world_from_upright(self.recording.up)
        size = float(np.linalg.norm(self._highest - self._lowest))
        position = self._middle + size * upright @ np.array([1.0, 0.8, 0.5])
        return rrb.EyeControls3D(position=position, look_target=self._middle, eye_up=upright[:, 2])

    def log_cameras(self) -> None:
        """Log the cameras where they stand, with their lenses, drawn at a size that suits their distance."""
        axis, direction = self.recording.up[-1].upper(), "DOWN" if self.recording.up.startswith("-") else "UP"
        self.stream.log("/world", getattr(rr.ViewCoordinates, f"RIGHT_HAND_{axis}_{direction}"), static=True)
        for camera in self.cameras:
            pose = camera.world_from_camera
            placed = rr.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
            lens = rr.Pinhole(
                image_from_camera=camera.intrinsics,
                resolution=camera.size,
                camera_xyz=rr.ViewCoordinates.RDF,
                image_plane_distance=0.12 * float(np.linalg.norm(pose[:3, 3] - self._middle)),
            )
            self.stream.log(camera_entity(camera.name), placed, lens, static=True)

    def set_frame(self, frame: int) -> None:
        """Set both timelines to a frame, the recording's number."""
        self.stream.set_time(FRAME, sequence=frame)
        self.stream.set_time(TIME, duration=frame / self.recording.fps)

    def log_pictures(self, jpegs: Sequence[bytes | None], static: bool = False) -> None:
        """Log encoded pictures of all cameras at the time that is set; None leaves one out."""
        for camera, jpeg in zip(self.cameras, jpegs, strict=False):
            if jpeg is not None:
                encoded = rr.EncodedImage(contents=jpeg, media_type="image/jpeg")
                self.stream.log(f"{camera_entity(camera.name)}/picture", encoded, static=static)

    def log_markers(self, truth: GroundTruth | None, first: int, stop: int) -> None:
        """Log true markers over [first, stop) of the frames, where there are any."""
        if truth is None or truth.markers is None:
            return
        shown = np.arange(first, min(stop, len(truth.markers)))
        present = [points[np.isfinite(points).all(axis=1)] for points in truth.markers[shown]]
        look = rr.Points3D.from_fields(colors=[[255, 255, 255]], radii=[0.01])
        self.stream.log("/world/truth/markers", look, static=True)
        times = [rr.TimeColumn(FRAME, sequence=shown), rr.TimeColumn(TIME, duration=shown / float(truth.fps))]
        points = rr.Points3D.columns(positions=np.concatenate(present).astype(np.float32))
        self.stream.send_columns("/world/truth/markers", times, points.partition([len(part) for part in present]))


def log_look(
    stream: rr.RecordingStream,
    entity: str,
    motion: Motion,
    bones: Bones,
    actor: int,
    colors: np.ndarray,
    static: bool = False,
) -> None:
    """Log what does not change about an actor: colours, widths, sizes of its blobs.

    Blobs are only static where the motion's frames are not on the timelines: else they would stand there before it.
    """
    if len(bones.edges):
        look = {"colors": actor_palette(actor)[bones.sides], "radii": [0.008]}
        stream.log(f"{entity}/skeleton", rr.LineStrips3D.from_fields(**look), static=True)
    sizes = np.repeat(motion.blob_sigma.astype(np.float32)[:, None], 3, axis=1)
    look = {"half_sizes": sizes, "colors": colors, "fill_mode": rr.components.FillMode.Solid}
    stream.set_time(FRAME, sequence=int(motion.frame[0]))
    stream.set_time(TIME, duration=float(motion.time[0]))
    stream.log(f"{entity}/blobs", rr.Ellipsoids3D.from_fields(**look), static=static)
    stream.reset_time()


def log_body(
    stream: rr.RecordingStream,
    entity: str,
    motion: Motion,
    bones: Bones,
    times: list[rr.TimeColumn] | None = None,
) -> None:
    """Log lines and blobs of every frame, at the motion's own times by default."""
    times = time_columns(motion) if times is None else times
    points = bones.points(motion)
    if num_edges := len(bones.edges):
        strips = points[:, bones.edges].reshape(-1, 2, 3)
        columns = rr.LineStrips3D.columns(strips=strips).partition([num_edges] * len(points))
        stream.send_columns(f"{entity}/skeleton", times, columns)
    centers = motion.blob_means.reshape(-1, 3).astype(np.float32)
    columns = rr.Ellipsoids3D.columns(centers=centers).partition([len(motion.blob_sigma)] * len(points))
    stream.send_columns(f"{entity}/blobs", times, columns)


def log_doubts(stream: rr.RecordingStream, entity: str, motion: Motion, bones: Bones) -> None:
    """Log white balls around the joints of limbs that are in doubt, the larger the doubt, where limbs were judged."""
    if motion.limb_doubt is None or motion.joint_limb is None or not motion.limb_doubt.shape[1]:
        return
    limb = motion.joint_limb[bones.joints]
    doubtful = in_doubt(motion)[:, limb] & (limb >= 0)
    places = motion.world_from_joint[:, bones.joints][..., :3, 3].astype(np.float32)
    radii = (0.06 * motion.limb_doubt[:, limb]).astype(np.float32)  # metres, of a limb that is certainly lost
    colors = [[255, 255, 255, 110]] * int(doubtful.sum())
    columns = rr.Points3D.columns(positions=places[doubtful], radii=radii[doubtful], colors=colors)
    stream.send_columns(f"{entity}/doubtful", time_columns(motion), columns.partition(doubtful.sum(axis=1)))
