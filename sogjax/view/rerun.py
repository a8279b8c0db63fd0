"""Everything of a tracked recording in one Rerun file; every call of Rerun in this project stands here."""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from itertools import repeat
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from jaxtyping import Float

from sogjax.data.atomic import atomic_path
from sogjax.data.ground_truth import GroundTruth
from sogjax.data.motion import Motion
from sogjax.data.recording import Recording
from sogjax.model.frames import world_from_upright
from sogjax.view.bones import Bones, actor_palette, blob_palette, bones_from_motion
from sogjax.view.frames import frame_range
from sogjax.view.picture_camera import PictureCamera, picture_camera

APPLICATION = "sogjax"
FRAME, TIME, ITERATION = "frame", "time", "iteration"
"""The timelines: the recording's frame, seconds since its frame 0, the solver's iterations over all frames."""
CAMERAS_SHOWN = 4
QUALITY = 80
"""Of the JPEG pictures, 0 to 100."""


class ImageBlobs(NamedTuple):
    """The blobs of one picture: undistorted pixels of the picture as recorded, sRGB in 0..1."""

    means: np.ndarray
    sigmas: np.ndarray
    colors: np.ndarray


def write_rerun(
    path: Path,
    recording: Recording,
    motions: Sequence[Motion],
    *,
    names: Sequence[str] | None = None,
    frames: Iterable[Sequence[np.ndarray | None]] | None = None,
    image_blobs: Iterable[Sequence[ImageBlobs | None]] | None = None,
    blob_colors: Sequence[Float[np.ndarray, "_ 3"]] | None = None,
    terms: Mapping[str, Float[np.ndarray, "frame"]] | None = None,
    traces: Mapping[str, Sequence[np.ndarray]] | None = None,
    truth: GroundTruth | None = None,
    picture_width: int = 640,
    quality: int = QUALITY,
    progress: Callable[[Iterable[int], int, str], Iterable[int]] = lambda items, count, title: items,
) -> None:
    """Write cameras, pictures, bodies, markers and curves, with a layout that opens well.

    Pictures are made smaller and freed of their lens distortion, so that everything in them lies as in 3-D.

    Args:
        path: the `.rrd` file, replaced as a whole.
        recording: what was tracked.
        motions: one for each actor.
        names: the actors' names; default `actor`, `actor_2`, ...
        frames: BGR pictures of all cameras, from the motions' first frame to their last; None: no pictures.
        image_blobs: the pictures' blobs, in the same order.
        blob_colors: sRGB in 0..1 of each actor's blobs; default by the side of the body.
        terms: further curves by name over the first motion's frames, such as `limit_penalty`.
        traces: curves by name over the iterations, one array for each of the first motion's frames.
        truth: markers to show beside the bodies.
        picture_width: largest width of the stored pictures in pixels.
        quality: of the JPEG pictures, 0 to 100.
        progress: wraps the frames' numbers to show how far it is: (numbers, count, title).
    """
    names = list(names) if names else ["actor", *(f"actor_{k + 2}" for k in range(len(motions) - 1))][: len(motions)]
    first, stop = frame_range(recording, motions)
    with RerunFile(path, recording, names, blob_colors=blob_colors, picture_width=picture_width) as file:
        file.write(motions, terms or {})
        if frames is not None or image_blobs is not None:
            numbers = progress(range(first, stop), stop - first, "Rerun file")
            for frame, pictures, blobs in zip(numbers, frames or repeat(()), image_blobs or repeat(()), strict=False):
                file.write_pictures(frame, [file.jpeg(k, image, quality) for k, image in enumerate(pictures)], blobs)
        file.write_traces(motions[0], traces or {})
        file.write_markers(truth)


class RerunFile:
    """A Rerun file that is written as the motion comes, within a `with` block; it gets its name when it is whole.

    Args:
        path: the `.rrd` file, replaced as a whole.
        recording: what is tracked.
        names: the actors' names.
        blob_colors: sRGB in 0..1 of each actor's blobs; default by the side of the body.
        picture_width: largest width of the stored pictures in pixels.
    """

    def __init__(
        self,
        path: Path,
        recording: Recording,
        names: Sequence[str],
        *,
        blob_colors: Sequence[Float[np.ndarray, "_ 3"]] | None = None,
        picture_width: int = 640,
    ) -> None:
        self._path, self._recording, self._names = Path(path), recording, list(names)
        self._cameras = [picture_camera(recording.rig, name, picture_width) for name in recording.rig.names]
        self._colors = None if blob_colors is None else [_bytes(colors) for colors in blob_colors]
        self._bones: list[Bones] = []
        self._paths: list[list[np.ndarray]] = [[] for _ in names]
        self._lowest, self._highest = np.full(3, np.inf), np.full(3, -np.inf)
        self._frames = (0, 0)
        self._with_blobs = False
        self._plots: dict[str, str] = {}

    def __enter__(self) -> "RerunFile":
        self._files = ExitStack()
        self._stream = rr.RecordingStream(APPLICATION)
        self._stream.set_log_time_enabled(False)
        self._stream.set_log_tick_enabled(False)
        self._stream.save(self._files.enter_context(atomic_path(self._path)))
        self._stream.send_recording_name(self._recording.name)
        return self

    def jpeg(self, camera: int, image: np.ndarray | None, quality: int = QUALITY) -> bytes | None:
        """A camera's picture (BGR) as it is stored; thread-safe."""
        return None if image is None else self._cameras[camera].jpeg(image, quality)

    def write(self, motions: Sequence[Motion], terms: Mapping[str, Float[np.ndarray, "frame"]]) -> None:
        """The bodies and curves of the frames that follow.

        Args:
            motions: one for each actor.
            terms: further curves by name, over the first motion's frames.
        """
        if not self._bones:
            self._begin(motions, terms)
        for k, (name, motion) in enumerate(zip(self._names, motions, strict=True)):
            self._paths[k].append(_log_actor(self._stream, f"/world/actors/{name}", motion, self._bones[k]))
            _log_curves(self._stream, motion, self._curve_actor(name), _own_curves(motion))
            self._lowest = np.minimum(self._lowest, motion.blob_means.min(axis=(0, 1)))
            self._highest = np.maximum(self._highest, motion.blob_means.max(axis=(0, 1)))
        _log_curves(self._stream, motions[0], None, terms)
        first, stop = frame_range(self._recording, motions)
        self._frames = (min(first, self._frames[0]) if self._frames[1] else first, stop)

    def write_pictures(
        self, frame: int, jpegs: Sequence[bytes | None], image_blobs: Sequence[ImageBlobs | None]
    ) -> None:
        """The pictures of all cameras, as `jpeg` makes them, and their blobs; either may be empty."""
        self._with_blobs |= len(image_blobs) > 0
        self._stream.set_time(FRAME, sequence=frame)
        self._stream.set_time(TIME, duration=frame / self._recording.fps)
        for camera, jpeg in zip(self._cameras, jpegs, strict=False):
            if jpeg is not None:
                encoded = rr.EncodedImage(contents=jpeg, media_type="image/jpeg")
                self._stream.log(f"{_entity(camera.name)}/picture", encoded)
        for camera, sog in zip(self._cameras, image_blobs, strict=False):
            if sog is not None:
                radii = np.asarray(sog.sigmas) * float(np.sqrt(camera.scale.prod()))
                points = rr.Points2D(camera.pixels(np.asarray(sog.means)), radii=radii, colors=_bytes(sog.colors))
                self._stream.log(f"{_entity(camera.name)}/blobs", points)
        self._stream.reset_time()

    def write_traces(self, motion: Motion, traces: Mapping[str, Sequence[np.ndarray]]) -> None:
        """Curves by name over the iterations, one array for each of the motion's frames."""
        _log_traces(self._stream, motion, traces)
        self._plots |= {"trace": "Within frames (timeline: iteration)"} if traces else {}

    def write_markers(self, truth: GroundTruth | None) -> None:
        """True markers beside the bodies, over the frames that were written."""
        if truth is not None and truth.markers is not None:
            _log_markers(self._stream, truth, self._frames)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Write what is known only at the end, or remove the file after an error."""
        if error is not None:
            self._stream.disconnect()
            self._files.__exit__(kind, error, traceback)
            return
        with self._files:
            if self._bones:
                self._end()
            self._stream.flush()
            self._stream.disconnect()

    def _end(self) -> None:
        """What needs the whole motion: how cameras are shown, the roots' paths, the layout."""
        middle, size = 0.5 * (self._lowest + self._highest), float(np.linalg.norm(self._highest - self._lowest))
        _log_cameras(self._stream, self._recording, self._cameras, middle)
        for k, name in enumerate(self._names):
            _log_path(self._stream, f"/world/actors/{name}", np.concatenate(self._paths[k]), k)
        eye = _eye(self._recording, middle, size)
        self._stream.send_blueprint(_blueprint(self._recording, self._names, self._with_blobs, self._plots, eye))

    def _begin(self, motions: Sequence[Motion], terms: Mapping[str, np.ndarray]) -> None:
        """What stands once in the file: looks of bodies and curves."""
        self._bones = [bones_from_motion(motion) for motion in motions]
        self._plots = _plots_with(terms)
        for k, (name, motion) in enumerate(zip(self._names, motions, strict=True)):
            colors = blob_palette(motion, k) if self._colors is None else self._colors[k]
            _log_look(self._stream, f"/world/actors/{name}", motion, self._bones[k], k, colors)
            _log_curve_looks(self._stream, self._curve_actor(name), _own_curves(motion), 3 * k)
        _log_curve_looks(self._stream, None, terms, 3 * len(motions))

    def _curve_actor(self, name: str) -> str | None:
        return name if len(self._names) > 1 else None


def view_command(path: Path, web: bool = False) -> list[str]:
    """The command that opens a Rerun file in a window, or serves it to a browser; reached from this machine only.

    The window listens for further data too, on all of the machine's addresses unless told otherwise.
    """
    command = [sys.executable, "-m", "rerun", str(path), "--bind", "127.0.0.1"]
    return [*command, "--serve-web"] if web else command


def _log_cameras(
    stream: rr.RecordingStream, recording: Recording, cameras: list[PictureCamera], middle: np.ndarray
) -> None:
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
        stream.log(_entity(camera.name), placed, lens, static=True)


def _log_look(
    stream: rr.RecordingStream, entity: str, motion: Motion, bones: Bones, actor: int, colors: np.ndarray
) -> None:
    if len(bones.edges):
        look = {"colors": actor_palette(actor)[bones.sides], "radii": [0.008]}
        stream.log(f"{entity}/skeleton", rr.LineStrips3D.from_fields(**look), static=True)
    sizes = np.repeat(motion.blob_sigma.astype(np.float32)[:, None], 3, axis=1)
    solid = rr.components.FillMode.Solid
    look = {"half_sizes": sizes, "colors": colors, "fill_mode": solid}
    stream.set_time(FRAME, sequence=int(motion.frame[0]))  # not static: there would be blobs before the first frame
    stream.set_time(TIME, duration=float(motion.time[0]))
    stream.log(f"{entity}/blobs", rr.Ellipsoids3D.from_fields(**look))
    stream.reset_time()


def _log_actor(stream: rr.RecordingStream, entity: str, motion: Motion, bones: Bones) -> np.ndarray:
    """The frames of a body; returns the path of its root."""
    points = bones.points(motion)
    num_frames, num_edges = len(points), len(bones.edges)
    if num_edges:
        strips = points[:, bones.edges].reshape(-1, 2, 3)
        columns = rr.LineStrips3D.columns(strips=strips).partition([num_edges] * num_frames)
        stream.send_columns(f"{entity}/skeleton", _times(motion), columns)
    centers = motion.blob_means.reshape(-1, 3).astype(np.float32)
    columns = rr.Ellipsoids3D.columns(centers=centers).partition([len(motion.blob_sigma)] * num_frames)
    stream.send_columns(f"{entity}/blobs", _times(motion), columns)
    return points[:, 0] if bones.num_joints else motion.blob_means.mean(axis=1)


def _log_path(stream: rr.RecordingStream, entity: str, path: np.ndarray, actor: int) -> None:
    trail = rr.LineStrips3D([path], colors=[actor_palette(actor)[1]], radii=[0.004])
    stream.log(f"{entity}/path", trail, static=True)


def _own_curves(motion: Motion) -> dict[str, np.ndarray]:
    return {"similarity": motion.similarity, "energy": motion.energy, "iterations": motion.iterations}


def _log_curve_looks(
    stream: rr.RecordingStream, actor: str | None, curves: Mapping[str, np.ndarray], first_color: int
) -> None:
    for k, name in enumerate(curves):
        title, color = f"{name} {actor}" if actor else name, _CURVE_COLORS[(first_color + k) % len(_CURVE_COLORS)]
        stream.log(_curve(name, actor), rr.SeriesLines(names=title, colors=color, widths=1.5), static=True)


def _log_curves(
    stream: rr.RecordingStream, motion: Motion, actor: str | None, curves: Mapping[str, np.ndarray]
) -> None:
    for name, values in curves.items():
        scalars = rr.Scalars.columns(scalars=np.asarray(values, float))
        stream.send_columns(_curve(name, actor), _times(motion), scalars)


def _curve(name: str, actor: str | None) -> str:
    return f"/curves/{_plot(name)}/{name}" + (f"/{actor}" if actor else "")


def _log_traces(stream: rr.RecordingStream, motion: Motion, traces: Mapping[str, Sequence[np.ndarray]]) -> None:
    for name, by_frame in traces.items():
        counts = [len(values) for values in by_frame]
        values = np.concatenate([np.asarray(values, float) for values in by_frame])
        times = [
            rr.TimeColumn(ITERATION, sequence=np.arange(len(values))),
            rr.TimeColumn(FRAME, sequence=np.repeat(motion.frame, counts)),
        ]
        entity = f"/curves/trace/{name}"
        stream.log(entity, rr.SeriesLines(names=name), static=True)
        stream.send_columns(entity, times, rr.Scalars.columns(scalars=values))


def _log_markers(stream: rr.RecordingStream, truth: GroundTruth, frames: tuple[int, int]) -> None:
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


def _blueprint(
    recording: Recording, names: Sequence[str], with_blobs: bool, plots: dict[str, str], eye: rrb.EyeControls3D
) -> rrb.Blueprint:
    """A large 3-D view, a few cameras beside it, the curves below."""
    shown = _spread(recording.rig.names, CAMERAS_SHOWN // 2 if with_blobs else CAMERAS_SHOWN)
    skeletons = [f"/world/actors/{name}/skeleton" for name in names]
    views = []
    for name in shown:
        origin = _entity(name)
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


_CURVE_COLORS = ((90, 170, 255), (255, 170, 60), (120, 220, 120), (255, 110, 120), (190, 140, 255), (240, 220, 90))


def _plots_with(terms: Mapping[str, np.ndarray]) -> dict[str, str]:
    """Titles of the plots that have something to show."""
    plots = {"energy": "Similarity and energy"}
    if any(_plot(name) == "penalties" for name in terms):
        plots["penalties"] = "Penalties"
    return plots | {"iterations": "Iterations"}


def _plot(curve: str) -> str:
    """Which plot a curve belongs in."""
    if "penalty" in curve:
        return "penalties"
    return "iterations" if curve == "iterations" else "energy"


def _eye(recording: Recording, middle: np.ndarray, size: float) -> rrb.EyeControls3D:
    """Look at the middle of what moves, from the front left and a little above."""
    upright = world_from_upright(recording.up)
    position = middle + size * upright @ np.array([1.0, 0.8, 0.5])
    return rrb.EyeControls3D(position=position, look_target=middle, eye_up=upright[:, 2])


def _entity(camera: str) -> str:
    return f"/world/cameras/{camera}"


def _times(motion: Motion) -> list[rr.TimeColumn]:
    return [rr.TimeColumn(FRAME, sequence=motion.frame), rr.TimeColumn(TIME, duration=motion.time)]


def _spread(names: Sequence[str], count: int) -> list[str]:
    """At most `count` of the names, evenly taken from the list."""
    count = min(count, len(names))
    return [names[k * len(names) // count] for k in range(count)]


def _bytes(colors: np.ndarray) -> np.ndarray:
    return np.rint(255.0 * np.clip(np.asarray(colors), 0.0, 1.0)).astype(np.uint8)
