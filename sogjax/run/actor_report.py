"""The report beside an actor file: figures, pictures of silhouettes and colours, and a page to read."""

import json
from pathlib import Path

import numpy as np

from sogjax.actor.coverage import body_silhouette
from sogjax.actor.report import ActorReport, FinishedActor, actor_report
from sogjax.io.calibration.rig import CameraRig
from sogjax.io.files import write_file
from sogjax.io.image_file import write_image
from sogjax.scene.background_difference import reduced_mask
from sogjax.view.sheets import LEGEND, SilhouetteView, body_picture, silhouette_sheet


def report_folder(actor: Path) -> Path:
    """`anna_report` beside `anna.yaml`."""
    return actor.with_name(f"{actor.stem}_report")


def write_actor_report(folder: Path, made: FinishedActor, rig: CameraRig) -> ActorReport:
    """Write silhouettes_POSE.png, colors.png, actor_report.json and report.md; the page comes last."""
    report = actor_report(made, rig)
    for pose in report.ious:
        write_image(folder / f"silhouettes_{pose}.png", _pose_sheet(made, rig, report, pose))
    blobs = made.body.posed_blobs(made.body.poses["rest"])
    means, sigmas, colors = (np.asarray(part, float) for part in (blobs.means, blobs.sigmas, blobs.colors))
    write_image(folder / "colors.png", body_picture(means, sigmas, colors))
    _write_text(folder / "actor_report.json", json.dumps(report.as_dict(), indent=2) + "\n")
    _write_text(folder / "report.md", report_page(report))
    return report


def report_page(report: ActorReport) -> str:
    """The report as Markdown."""
    cameras = list(dict.fromkeys(camera for row in report.ious.values() for camera in row))
    cell = lambda pose, camera: f"{report.ious[pose][camera]:.2f}" if camera in report.ious[pose] else ""
    rows = [[pose, f"{report.pose_iou(pose):.2f}", *(cell(pose, c) for c in cameras)] for pose in report.ious]
    millimetres = lambda bone: [f"{1000 * length:.0f}" for length in (bone.before, bone.after)]
    change = lambda bone: f"{100 * (bone.after / max(bone.before, 1e-9) - 1):+.1f}"
    bones = [[bone.name, *millimetres(bone), change(bone)] for bone in report.bones]
    sections = [
        f"# Actor {report.name}",
        f"Silhouettes of the body agree with the masks to {report.mean_iou:.2f} on average (intersection over union).",
        "## Warnings",
        "\n".join(f"- {warning}" for warning in report.warnings) or "None.",
        *(("## Notes", "\n".join(f"- {note}" for note in report.notes)) if report.notes else ()),
        "## Silhouettes",
        _table(["pose", "mean", *cameras], rows),
        f"In the pictures, {LEGEND}.",
        *(f"![{pose}](silhouettes_{pose}.png)" for pose in report.ious),
        "## Bone lengths",
        "In mm, of the body it started from and of the actor.",
        _table(["bone", "before", "after", "change, %"], bones),
        "## Colours",
        "The body at rest, from the front and from its left.",
        "![colours](colors.png)",
    ]
    return "\n\n".join(sections) + "\n"


def _pose_sheet(made: FinishedActor, rig: CameraRig, report: ActorReport, name: str) -> np.ndarray:
    posed = next(posed for posed in made.pictures if posed.name == name)
    views = []
    for camera, mask in posed.masks.items():
        small, label = reduced_mask(mask), rig.names[camera]
        silhouette = body_silhouette(made.upright_body, made.example_poses[name], rig.camera(label), small.shape)
        views.append(SilhouetteView(label, report.ious[name][label], posed.images[camera], small, silhouette))
    return silhouette_sheet(views, f"{report.name}, {name}: IoU {report.pose_iou(name):.2f}")


def _table(head: list[str], rows: list[list[str]]) -> str:
    line = lambda cells: f"| {' | '.join(cells)} |"
    return "\n".join([line(head), line(["---"] * len(head)), *map(line, rows)])


def _write_text(path: Path, text: str) -> None:
    write_file(path, text)
