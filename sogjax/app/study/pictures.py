"""The pictures of a report: charts of experiments, and the worst frames with the tracked skeleton."""

from collections.abc import Sequence

import cv2
import numpy as np

from sogjax.app.study.document import Picture
from sogjax.app.study.experiment import Experiment
from sogjax.app.study.record import RunRecord
from sogjax.app.study.runner import motions_of
from sogjax.app.study.source import Source
from sogjax.app.study.summary import RowSummary
from sogjax.data.video import read_frames
from sogjax.view.charts import mean_chart
from sogjax.view.overlay import overlay_frame

CAMERAS_SHOWN = 3
WIDTH, JPEG_QUALITY = 900, 70


def experiment_chart(experiment: Experiment, rows: Sequence[RowSummary]) -> Picture | None:
    """Mean errors with their intervals (or rates) over the rows; None where there is nothing to draw."""
    done = [row for row in rows if np.isfinite(row.mean)]
    if not done:
        return None
    speed = experiment.config.measure == "speed"
    names = list(dict.fromkeys(name for row in done for name in row.by_recording))
    content = mean_chart(
        [row.name for row in done],
        [row.rates.get("whole", np.nan) if speed else row.mean for row in done],
        [(np.nan, np.nan) if speed else row.interval for row in done],
        axis=experiment.config.axis,
        value="frames/s, whole" if speed else "marker error, mm",
        members={} if speed else {name: [row.by_recording.get(name, np.nan) for row in done] for name in names},
        paper=[row.paper_value for row in done],
    )
    what = "frames a second" if speed else "mean error with its 95 % interval; thin lines: each recording"
    return Picture(f"{experiment.name}.png", content, f"{experiment.config.title}: {what}")


def worst_frame(label: str, source: Source, record: RunRecord) -> Picture:
    """The frame of a run with the largest error, in the cameras that see it from different sides."""
    row = int(np.nanargmax(record.errors))
    frame = record.frame[row]
    motions = list(motions_of(record, source.bodies, source.recording.fps).values())
    number = frame - source.recording.first_frame
    images = next(iter(read_frames(source.recording, number, number + 1)))
    drawn = overlay_frame(
        images,
        source.recording.rig,
        motions,
        frame,
        cameras=source.cameras(min(CAMERAS_SHOWN, len(source.recording.rig.names))),
        width=WIDTH,
        columns=CAMERAS_SHOWN,
    )
    jpeg = cv2.imencode(".jpg", drawn, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])[1].tobytes()
    caption = f"{label}: {source.name}, frame {frame}, mean error {record.errors[row]:.0f} mm"
    name = "".join(letter if letter.isalnum() else "_" for letter in f"worst_{label}_{source.name}")
    return Picture(f"{name}.jpg", jpeg, caption)
