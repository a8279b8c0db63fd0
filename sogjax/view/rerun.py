"""Everything of a tracked recording in one Rerun file; every call of Rerun in this project stands here."""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
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
from sogjax.view.bones import actor_palette, blob_palette, bones_from_motion
from sogjax.view.frames import frame_range
from sogjax.view.picture_camera import PictureCamera, picture_camera

APPLICATION = "sogjax"
FRAME, TIME, ITERATION = "frame", "time", "iteration"
"""The timelines: the recording's frame, seconds since its frame 0, the solver's iterations over all frames."""
CAMERAS_SHOWN = 4


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
    quality: int = 80,
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
    cameras = [picture_camera(recording.rig, name, picture_width) for name in recording.rig.names]
    curves = _plots_with(terms or {}, traces or {})
    layout = _blueprint(recording, motions, names, image_blobs is not None, curves)
    with atomic_path(Path(path)) as temporary:
        stream = rr.RecordingStream(APPLICATION)
        stream.set_log_time_enabled(False)
        stream.set_log_tick_enabled(False)
        stream.save(temporary, default_blueprint=layout)
        stream.send_recording_name(recording.name)
        _log_cameras(stream, recording, cameras, motions)
        for k, (name, motion) in enumerate(zip(names, motions, strict=True)):
            colors = blob_palette(motion, k) if blob_colors is None else _bytes(blob_colors[k])
            _log_actor(stream, f"/world/actors/{name}", motion, k, colors)
            _log_curves(stream, motion, name if len(motions) > 1 else None, _own_curves(motion), 3 * k)
        _log_curves(stream, motions[0], None, terms or {}, 3 * len(motions))
        _log_traces(stream, motions[0], traces or {})
        if truth is not None and truth.markers is not None:
            _log_markers(stream, recording, truth, motions)
        _log_pictures(stream, recording, cameras, motions, frames, image_blobs, quality, progress)
        stream.flush()
        stream.disconnect()


def view_command(path: Path, web: bool = False) -> list[str]:
    """The command that opens a Rerun file in a window, or serves it to a browser of this machine only."""
    command = [sys.executable, "-m", "rerun", str(path)]
    return [*command, "--serve-web", "--bind", "127.0.0.1"] if web else command


def _log_cameras(
    stream: rr.RecordingStream,
    recording: Recording,
    cameras: list[PictureCamera],
    motions: Sequence[Motion],
) -> None:
    axis, direction = recording.up[-1].upper(), "DOWN" if recording.up.startswith("-") else "UP"
    stream.log("/world", getattr(rr.ViewCoordinates, f"RIGHT_HAND_{axis}_{direction}"), static=True)
    middle, _ = _middle_and_size(motions)
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


def _log_actor(stream: rr.RecordingStream, entity: str, motion: Motion, actor: int, colors: np.ndarray) -> None:
    bones = bones_from_motion(motion)
    num_frames, num_edges = len(bones.points), len(bones.edges)
    if num_edges:
        strips = bones.points[:, bones.edges].reshape(-1, 2, 3)
        look = {"colors": actor_palette(actor)[bones.sides], "radii": [0.008]}
        stream.log(f"{entity}/skeleton", rr.LineStrips3D.from_fields(**look), static=True)
        columns = rr.LineStrips3D.columns(strips=strips).partition([num_edges] * num_frames)
        stream.send_columns(f"{entity}/skeleton", _times(motion), columns)
    num_blobs = len(motion.blob_sigma)
    sizes = np.repeat(motion.blob_sigma.astype(np.float32)[:, None], 3, axis=1)
    solid = rr.components.FillMode.Solid
    look = {"half_sizes": sizes, "colors": colors, "fill_mode": solid}
    stream.set_time(FRAME, sequence=int(motion.frame[0]))  # not static: there would be blobs before the first frame
    stream.set_time(TIME, duration=float(motion.time[0]))
    stream.log(f"{entity}/blobs", rr.Ellipsoids3D.from_fields(**look))
    stream.reset_time()
    centers = motion.blob_means.reshape(-1, 3).astype(np.float32)
    columns = rr.Ellipsoids3D.columns(centers=centers).partition([num_blobs] * num_frames)
    stream.send_columns(f"{entity}/blobs", _times(motion), columns)
    path = bones.points[:, 0] if bones.num_joints else motion.blob_means.mean(axis=1)
    trail = rr.LineStrips3D([path], colors=[actor_palette(actor)[1]], radii=[0.004])
    stream.log(f"{entity}/path", trail, static=True)


def _own_curves(motion: Motion) -> dict[str, np.ndarray]:
    return {"similarity": motion.similarity, "energy": motion.energy, "iterations": motion.iterations}


def _log_curves(
    stream: rr.RecordingStream,
    motion: Motion,
    actor: str | None,
    curves: Mapping[str, np.ndarray],
    first_color: int,
) -> None:
    for k, (name, values) in enumerate(curves.items()):
        entity = f"/curves/{_plot(name)}/{name}" + (f"/{actor}" if actor else "")
        title, color = f"{name} {actor}" if actor else name, _CURVE_COLORS[(first_color + k) % len(_CURVE_COLORS)]
        stream.log(entity, rr.SeriesLines(names=title, colors=color, widths=1.5), static=True)
        values = np.asarray(values, float)
        stream.send_columns(entity, _times(motion), rr.Scalars.columns(scalars=values))


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


def _log_markers(
    stream: rr.RecordingStream, recording: Recording, truth: GroundTruth, motions: Sequence[Motion]
) -> None:
    markers = truth.markers
    assert markers is not None
    first, stop = frame_range(recording, motions)
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


def _log_pictures(
    stream: rr.RecordingStream,
    recording: Recording,
    cameras: list[PictureCamera],
    motions: Sequence[Motion],
    frames: Iterable[Sequence[np.ndarray | None]] | None,
    image_blobs: Iterable[Sequence[ImageBlobs | None]] | None,
    quality: int,
    progress: Callable[[Iterable[int], int, str], Iterable[int]],
) -> None:
    """Pictures and their blobs, as they come: only one frame is held at a time."""
    if frames is None and image_blobs is None:
        return
    first, stop = frame_range(recording, motions)
    pictures, blobs = iter(frames or ()), iter(image_blobs or ())
    for frame in progress(range(first, stop), stop - first, "Rerun file"):
        stream.set_time(FRAME, sequence=frame)
        stream.set_time(TIME, duration=frame / recording.fps)
        for camera, image in zip(cameras, next(pictures, ())):  # noqa: B905 - the pictures may have ended
            if image is not None:
                encoded = rr.EncodedImage(contents=camera.jpeg(image, quality), media_type="image/jpeg")
                stream.log(f"{_entity(camera.name)}/picture", encoded)
        for camera, sog in zip(cameras, next(blobs, ())):  # noqa: B905
            if sog is not None:
                radii = np.asarray(sog.sigmas) * float(np.sqrt(camera.scale.prod()))
                points = rr.Points2D(camera.pixels(np.asarray(sog.means)), radii=radii, colors=_bytes(sog.colors))
                stream.log(f"{_entity(camera.name)}/blobs", points)
    stream.reset_time()


def _blueprint(
    recording: Recording, motions: Sequence[Motion], names: Sequence[str], with_blobs: bool, plots: dict[str, str]
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
    scene = rrb.Spatial3DView(origin="/world", name="Scene", eye_controls=_eye(recording, motions))
    top = rrb.Horizontal(scene, rrb.Grid(*views, grid_columns=2), column_shares=[1, 1])
    return rrb.Blueprint(
        rrb.Vertical(top, rrb.Horizontal(*curves), row_shares=[3, 1]),
        rrb.TimePanel(state="collapsed", timeline=FRAME, fps=recording.fps, loop_mode="All"),
        rrb.SelectionPanel(state="hidden"),
        rrb.BlueprintPanel(state="collapsed"),
    )


_CURVE_COLORS = ((90, 170, 255), (255, 170, 60), (120, 220, 120), (255, 110, 120), (190, 140, 255), (240, 220, 90))


def _plots_with(terms: Mapping[str, np.ndarray], traces: Mapping[str, Sequence[np.ndarray]]) -> dict[str, str]:
    """Titles of the plots that have something to show."""
    plots = {"energy": "Similarity and energy"}
    if any(_plot(name) == "penalties" for name in terms):
        plots["penalties"] = "Penalties"
    plots["iterations"] = "Iterations"
    return plots | ({"trace": "Within frames (timeline: iteration)"} if traces else {})


def _plot(curve: str) -> str:
    """Which plot a curve belongs in."""
    if "penalty" in curve:
        return "penalties"
    return "iterations" if curve == "iterations" else "energy"


def _eye(recording: Recording, motions: Sequence[Motion]) -> rrb.EyeControls3D:
    """Look at the middle of what moves, from the front left and a little above."""
    middle, size = _middle_and_size(motions)
    upright = world_from_upright(recording.up)
    position = middle + size * upright @ np.array([1.0, 0.8, 0.5])
    return rrb.EyeControls3D(position=position, look_target=middle, eye_up=upright[:, 2])


def _middle_and_size(motions: Sequence[Motion]) -> tuple[np.ndarray, float]:
    points = np.concatenate([motion.blob_means.reshape(-1, 3) for motion in motions])
    lowest, highest = points.min(axis=0), points.max(axis=0)
    return 0.5 * (lowest + highest), float(np.linalg.norm(highest - lowest))


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
