"""The report beside an actor file: figures for programs, and a page to read."""

import json
from pathlib import Path

import numpy as np

from sogjax.actor.coverage import body_silhouette
from sogjax.actor.report import ActorReport, FinishedActor, actor_report
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.files import write_file
from sogjax.scene.background_difference import reduced_mask
from sogjax.view.page.actor_page import actor_page
from sogjax.view.sheets import SilhouetteView, body_picture, silhouette_sheet

PAGE = "index.html"


def report_folder(actor: Path) -> Path:
    """`anna_report` beside `anna.yaml`."""
    return actor.with_name(f"{actor.stem}_report")


def write_actor_report(folder: Path, made: FinishedActor, rig: CameraRig) -> ActorReport:
    """Write actor_report.json and the page, which comes last; loose pictures of older reports go."""
    report = actor_report(made, rig)
    for older in (*folder.glob("silhouettes_*.png"), folder / "colors.png", folder / "report.md"):
        older.unlink(missing_ok=True)
    write_file(folder / "actor_report.json", json.dumps(report.as_dict(), indent=2) + "\n")
    write_file(folder / PAGE, report_page(report, made, rig))
    return report


def report_page(report: ActorReport, made: FinishedActor, rig: CameraRig) -> str:
    """The report as a page for a browser."""
    blobs = made.body.posed_blobs(made.body.poses["rest"])
    means, sigmas, colors = (np.asarray(part, float) for part in (blobs.means, blobs.sigmas, blobs.colors))
    return actor_page(
        report.name,
        report.mean_iou,
        report.warnings,
        report.notes,
        report.ious,
        {pose: _pose_sheet(made, rig, report, pose) for pose in report.ious},
        [(bone.name, bone.before, bone.after) for bone in report.bones],
        body_picture(means, sigmas, colors),
    )


def _pose_sheet(made: FinishedActor, rig: CameraRig, report: ActorReport, name: str) -> np.ndarray:
    posed = next(posed for posed in made.pictures if posed.name == name)
    views = []
    for camera, mask in posed.masks.items():
        small, label = reduced_mask(mask), rig.names[camera]
        silhouette = body_silhouette(made.upright_body, made.example_poses[name], rig.camera(label), small.shape)
        views.append(SilhouetteView(label, report.ious[name][label], posed.images[camera], small, silhouette))
    return silhouette_sheet(views, f"{report.name}, {name}: IoU {report.pose_iou(name):.2f}")
