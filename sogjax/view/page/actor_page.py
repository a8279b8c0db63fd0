"""The page of an actor: how its silhouettes fit the masks, its bones, its colours."""

from collections.abc import Mapping, Sequence

from sogjax.view.page.document import Picture, Section, bullets, document, figure, paragraph, table, text
from sogjax.view.sheets import LEGEND


def actor_page(
    name: str,
    mean_iou: float,
    warnings: Sequence[str],
    notes: Sequence[str],
    ious: Mapping[str, Mapping[str, float]],
    sheets: Mapping[str, Picture],
    bones: Sequence[tuple[str, float, float]],
    colors: Picture,
) -> str:
    """The page as HTML.

    Args:
        name: of the actor.
        mean_iou: intersection over union of silhouettes and masks, mean over all poses and cameras.
        warnings: one sentence each.
        notes: sentences about what is usual.
        ious: by pose and camera.
        sheets: silhouettes over the masks, by pose.
        bones: name, and length before and after, metres.
        colors: the body in its colours.
    """
    kind, mark, said = ("look", "!", "Look at it") if warnings else ("right", "✓", "Nothing stands out")
    agree = (
        f"Silhouettes of the body agree with the masks to {mean_iou:.2f} on average (intersection over union; 0.8 and "
        "more is usual)."
    )
    verdict = (
        f'<div class="card verdict {kind}"><h3><span class="mark" aria-hidden="true">{mark}</span>{said}</h3>'
        f"{paragraph(agree)}{bullets(text(each) for each in warnings)}</div>"
    )
    noted = bullets(text(each) for each in notes)
    cameras = list(dict.fromkeys(camera for row in ious.values() for camera in row))
    cell = lambda row, camera: f"{row[camera]:.2f}" if camera in row else ""
    rows = [
        (pose, f"{sum(row.values()) / max(len(row), 1):.2f}", *(cell(row, camera) for camera in cameras))
        for pose, row in ious.items()
    ]
    pictures = "".join(
        figure(sheet, f"Silhouettes over the masks of pose {pose}, {LEGEND}", text(pose))
        for pose, sheet in sheets.items()
    )
    lengths = [
        (bone, f"{1000 * before:.0f}", f"{1000 * after:.0f}", f"{100 * (after / max(before, 1e-9) - 1):+.1f}")
        for bone, before, after in bones
    ]
    sections = [
        Section("Verdict", verdict + (f"<h3>Notes</h3>{noted}" if noted else "")),
        Section(
            "Silhouettes",
            f"{table(('pose', 'mean', *cameras), rows)}{paragraph(f'In the pictures, {LEGEND}.', 'note')}{pictures}",
        ),
        Section(
            "Bone lengths",
            paragraph("In mm, of the body it started from and of the actor.", "note")
            + table(("bone", "before", "after", "change, %"), lengths),
        ),
        Section(
            "Colours", figure(colors, f"The blobs of {name} at rest", "The body at rest, from the front and its left.")
        ),
    ]
    return document(f"Actor {name}", "How the body fits the pictures that it was made of", sections)
