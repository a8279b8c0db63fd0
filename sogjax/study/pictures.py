"""The pictures of a report: charts of experiments, and a section of the worst frames with the tracked skeleton."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from jaxtyping import Float

from sogjax.io.calibration.rig import CameraRig
from sogjax.io.motion import Motion
from sogjax.io.video import read_chosen
from sogjax.study.document import Picture, Section
from sogjax.study.experiment import Experiment
from sogjax.study.record import Done, RunRecord
from sogjax.study.runner import motions_of
from sogjax.study.source import Source
from sogjax.study.summary import RowSummary
from sogjax.view.charts import Bars, Means, bar_chart, mean_chart
from sogjax.view.overlay import overlay_frame
from sogjax.view.projection import picture_points
from sogjax.view.tiles import write_label

CAMERAS_SHOWN = 3
TILE, JPEG_QUALITY = 300, 75
MARGIN = 1.25
"""Side of what is cut out, in units of what it is about."""


def experiment_chart(experiment: Experiment, rows: Mapping[str, Sequence[RowSummary]]) -> Picture | None:
    """Mean errors with their intervals (or rates) over the rows, by method; None where there is nothing to draw."""
    done = {method: [row for row in of_method if np.isfinite(row.mean)] for method, of_method in rows.items()}
    if not any(done.values()):
        return None
    if experiment.config.reference is None:
        return _bars(experiment, done)
    speed = experiment.config.measure == "speed"
    papers = {name: row.paper_value for name, row in experiment.config.rows.items() if row.paper_value is not None}
    content = mean_chart(
        [_panel(method or "here", of_method, speed) for method, of_method in done.items() if of_method],
        axis=experiment.config.axis,
        value="frames/s, whole" if speed else "marker error, mm",
        paper=papers,
    )
    what = "Frames per second" if speed else "Mean error, its 95 % interval, and each recording"
    return Picture(f"{experiment.name}.png", content, what)


def _bars(experiment: Experiment, rows: Mapping[str, Sequence[RowSummary]]) -> Picture:
    """The joint errors of rows that are not compared with each other, a panel for each number of cameras."""
    joints = {method: {row.name: row.joints for row in of_method} for method, of_method in rows.items()}
    done = {
        name: row.cameras for name, row in experiment.config.rows.items() if any(name in of for of in joints.values())
    }
    panels = []
    for count in dict.fromkeys(done.values()):
        names = [name for name in done if done[name] == count]
        values = {method: [of_method.get(name, np.nan) for name in names] for method, of_method in joints.items()}
        values = {method: of_rows for method, of_rows in values.items() if np.isfinite(of_rows).any()}
        panels.append(Bars("all cameras" if count is None else f"{count} cameras", names, values))
    content = bar_chart(panels, value="joint error, mm")
    return Picture(f"{experiment.name}.png", content, "Mean error of the joints")


def _panel(title: str, rows: Sequence[RowSummary], speed: bool) -> Means:
    recordings = dict.fromkeys(name for row in rows for name in row.by_recording)
    return Means(
        [row.name for row in rows],
        [row.rates.get("whole", np.nan) if speed else row.mean for row in rows],
        [(np.nan, np.nan) if speed else row.interval for row in rows],
        title,
        {} if speed else {name: [row.by_recording.get(name, np.nan) for row in rows] for name in recordings},
    )


def worst_frame(label: str, source: Source, record: RunRecord) -> Picture:
    """The frame of a run with the largest error, in cameras that see it from different sides, cut out around it."""
    row = int(np.nanargmax(record.errors))
    frame = record.frame[row]
    recording = source.recording
    motions = list(motions_of(record, source.bodies, recording.fps).values())
    _, images = next(read_chosen(recording, [frame]))
    points = np.concatenate([motion.blob_means[row] for motion in motions] + _true_points(source, frame))
    cameras = source.cameras(min(CAMERAS_SHOWN, len(recording.rig.names)))
    cut = [_cut_out(images, recording.rig, motions, frame, camera, points) for camera in cameras]
    jpeg = cv2.imencode(".jpg", cv2.hconcat(cut), [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()
    caption = f"{label}: {source.name}, frame {frame}, mean error {record.errors[row]:.0f} mm"
    name = "".join(letter if letter.isalnum() else "_" for letter in f"worst_{label}_{source.name}")
    return Picture(f"{name}.jpg", jpeg, caption)


def _true_points(source: Source, frame: int) -> list[np.ndarray]:
    """Where the subjects really are."""
    truth = source.truth.markers if source.truth.markers is not None else source.truth.joints
    assert truth is not None
    return [truth[frame][np.isfinite(truth[frame]).all(axis=1)]]


def _cut_out(
    images: Sequence[np.ndarray | None],
    rig: CameraRig,
    motions: Sequence[Motion],
    frame: int,
    camera: str,
    points: Float[np.ndarray, "point 3"],
) -> np.ndarray:
    """One camera's picture with the skeletons, as far as the points (world) reach, as a square tile."""
    width, height = rig.image_size(camera)
    drawn = overlay_frame(images, rig, motions, frame, cameras=[camera], width=width)
    scale = drawn.shape[1] / width
    pixels = scale * picture_points(rig.select((camera,)), points[None].astype(np.float32))[0][0, 0]
    seen = pixels[np.isfinite(pixels).all(axis=1)].clip(0, (drawn.shape[1], drawn.shape[0]))
    low, high = (seen.min(axis=0), seen.max(axis=0)) if len(seen) else (np.zeros(2), np.array([width, height]))
    side = int(min(MARGIN * max(*(high - low), TILE / 2), *drawn.shape[:2]))
    x, y = (np.clip(0.5 * (low + high - side), 0, np.array([drawn.shape[1], drawn.shape[0]]) - side)).astype(int)
    tile = cv2.resize(drawn[y : y + side, x : x + side], (TILE, TILE), interpolation=cv2.INTER_AREA)
    write_label(tile, camera, (6, 14))
    return tile


def worst_section(done: Sequence[Done], count: int) -> Section:
    """The frames with the largest errors, at most one per experiment and method."""
    usable = [one for one in done if one.experiment.config.measure == "accuracy" and np.isfinite(one.record.mean_mm)]
    pictures: list[Picture] = []
    seen: set[tuple[str, str]] = set()
    for one in sorted(usable, key=lambda one: -np.nanmax(one.record.errors)):
        if (one.experiment.name, one.method) not in seen and len(pictures) < count:
            seen.add((one.experiment.name, one.method))
            parts = (one.experiment.config.title, one.method, one.row)
            pictures.append(worst_frame(", ".join(filter(None, parts)), one.source, one.record))
    return Section("Worst frames", ["The frame with the largest mean error of an experiment's runs."], pictures)
