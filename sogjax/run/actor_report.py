"""The report beside an actor file: figures for programs, and a page to read."""

import json
from pathlib import Path

import numpy as np

from sogjax.actor.coverage import body_silhouette
from sogjax.actor.make import MadeActor
from sogjax.actor.report import ActorReport, actor_report
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.files import write_file
from sogjax.model.body import Body
from sogjax.scene.background_difference import reduced_mask
from sogjax.view.page.document import Section, bullets, document, figure, paragraph, table, text
from sogjax.view.sheets import LEGEND, SilhouetteView, body_picture, silhouette_sheet

PAGE = "index.html"


def report_folder(actor: Path) -> Path:
    """`anna_report` beside `anna.yaml`."""
    return actor.with_name(f"{actor.stem}_report")


def write_actor_report(folder: Path, made: MadeActor, rig: CameraRig) -> ActorReport:
    """Write actor_report.json and the page, which comes last; loose pictures of older reports go."""
    report = actor_report(made, rig)
    for older in (*folder.glob("silhouettes_*.png"), folder / "colors.png", folder / "report.md"):
        older.unlink(missing_ok=True)
    write_file(folder / "actor_report.json", json.dumps(report.as_dict(), indent=2) + "\n")
    write_file(folder / PAGE, report_page(report, made, rig))
    return report


def report_page(report: ActorReport, made: MadeActor, rig: CameraRig) -> str:
    """The report as a page for a browser: how silhouettes fit the masks, bones, colours."""
    kind, mark, said = ("look", "!", "Look at it") if report.warnings else ("right", "✓", "Nothing stands out")
    agree = (
        f"Silhouettes of the body agree with the masks to {report.mean_iou:.2f} on average (intersection over union; "
        "0.8 and more is usual)."
    )
    verdict = (
        f'<div class="card verdict {kind}"><h3><span class="mark" aria-hidden="true">{mark}</span>{said}</h3>'
        f"{paragraph(agree)}{bullets(map(text, report.warnings))}</div>"
    )
    noted = bullets(map(text, report.notes))
    lengths = [
        (b.name, f"{1000 * b.before:.0f}", f"{1000 * b.after:.0f}", f"{100 * (b.after / max(b.before, 1e-9) - 1):+.1f}")
        for b in report.bones
    ]
    sections = [
        Section("Verdict", verdict + (f"<h3>Notes</h3>{noted}" if noted else "")),
        Section("Silhouettes", _silhouettes(report, made, rig)),
        Section(
            "Bone lengths",
            paragraph("In mm, of the body it started from and of the actor.", "note")
            + table(("bone", "before", "after", "change, %"), lengths),
        ),
        Section("Colours", _colors(report.name, made.body)),
    ]
    return document(f"Actor {report.name}", "How the body fits the pictures that it was made of", sections)


def _silhouettes(report: ActorReport, made: MadeActor, rig: CameraRig) -> str:
    """The agreement by pose and camera, and silhouettes over the masks of each pose."""
    cameras = list(dict.fromkeys(camera for row in report.ious.values() for camera in row))
    cell = lambda row, camera: f"{row[camera]:.2f}" if camera in row else ""
    rows = [
        (pose, f"{sum(row.values()) / max(len(row), 1):.2f}", *(cell(row, camera) for camera in cameras))
        for pose, row in report.ious.items()
    ]
    pictures = "".join(
        figure(_pose_sheet(made, rig, report, pose), f"Silhouettes over the masks of pose {pose}, {LEGEND}", text(pose))
        for pose in report.ious
    )
    return f"{table(('pose', 'mean', *cameras), rows)}{paragraph(f'In the pictures, {LEGEND}.', 'note')}{pictures}"


def _colors(name: str, body: Body) -> str:
    """The blobs at rest."""
    blobs = body.posed_blobs(body.poses["rest"])
    picture = body_picture(*(np.asarray(part, float) for part in (blobs.means, blobs.sigmas, blobs.colors)))
    return figure(picture, f"The blobs of {name} at rest", "The body at rest, from the front and its left.")


def _pose_sheet(made: MadeActor, rig: CameraRig, report: ActorReport, name: str) -> np.ndarray:
    posed = next(posed for posed in made.pictures if posed.name == name)
    views = []
    for camera, mask in posed.masks.items():
        small, label = reduced_mask(mask), rig.names[camera]
        silhouette = body_silhouette(made.upright_body, made.example_poses[name], rig.camera(label), small.shape)
        untold = reduced_mask(posed.untold[camera]) if camera in posed.untold else np.zeros_like(small)
        views.append(SilhouetteView(label, report.ious[name][label], posed.images[camera], small, silhouette, untold))
    return silhouette_sheet(views, f"{report.name}, {name}: IoU {report.pose_iou(name):.2f}")
