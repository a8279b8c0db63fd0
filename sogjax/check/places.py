"""Whether each video shows what its camera's still pictures show, or names were mixed up, or cameras moved."""

from collections.abc import Mapping

import cv2
import numpy as np
from jaxtyping import Float

from sogjax.check.findings import Finding
from sogjax.check.silhouettes import Moment, Picture

SIZE = (96, 72)
"""Pixels to which pictures are made smaller before they are compared."""
SAME = 0.55
"""Correlation of two pictures' fine structure above which they show the same place."""
MARGIN = 0.2


def references_of(plates: Mapping[int, Picture], photographed: Moment | None) -> dict[int, tuple[str, Picture]]:
    """By camera a still picture of what it sees: the empty scene, else an example pose."""
    found = (
        {camera: ("example pose", picture) for camera, picture in photographed.pictures.items()}
        if (photographed is not None)
        else {}
    )
    return {**found, **{camera: ("background picture", picture) for camera, picture in plates.items()}}


def place_findings(
    names: tuple[str, ...], references: Mapping[int, tuple[str, Picture]], filmed: Mapping[int, Picture]
) -> list[Finding]:
    """Videos (by camera a picture of each) that show what another camera's still pictures show, or what none shows."""
    likeness = place_likeness(references, filmed)
    findings, paired = [], set()
    for camera, row in likeness.items():
        if row[camera] >= SAME or camera in paired:
            continue
        other = max(row, key=row.__getitem__)
        label = references[camera][0]
        if row[other] < max(SAME, row[camera] + MARGIN):
            what = f"the video of {names[camera]} does not show the place of its {label} (likeness {row[camera]:.2f})"
            cause = "the camera was moved in between, or one of the files belongs to another camera"
            remedy = f"compare both; take the {label} again, or rename the file"
            findings.append(Finding("warning", "files", what, cause, remedy, (names[camera],)))
            continue
        back = likeness.get(other, {}).get(camera, 0.0)
        paired |= {camera, other} if back >= SAME else {camera}
        what = f"the video of {names[camera]} shows what the {references[other][0]} of {names[other]} shows"
        what += ", and the other way round" if back >= SAME else ""
        cause, remedy = "videos under the wrong names", f"swap the names of {names[camera]} and {names[other]}"
        findings.append(Finding("warning", "files", what, cause, remedy, (names[camera], names[other])))
    if likeness and not findings:
        findings.append(Finding("ok", "files", "every video shows the place that its camera's still pictures show"))
    return findings


def place_likeness(
    references: Mapping[int, tuple[str, Picture]], filmed: Mapping[int, Picture]
) -> dict[int, dict[int, float]]:
    """For each camera with a reference how alike its video's picture is with the reference of every camera."""
    structures = {camera: _structure(picture) for camera, (_, picture) in references.items()}
    rows = {}
    for camera in references.keys() & filmed.keys():
        own = _structure(filmed[camera])
        rows[camera] = {other: float((own * reference).mean()) for other, reference in structures.items()}
    return rows


def _structure(picture: Picture) -> Float[np.ndarray, "h w"]:
    """Edges and patterns of a picture, whatever its exposure: mean 0, variance 1."""
    grey = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), SIZE, interpolation=cv2.INTER_AREA)
    light = np.log1p(grey.astype(np.float32))
    fine = light - cv2.GaussianBlur(light, (0, 0), 6.0)
    return (fine - fine.mean()) / max(float(fine.std()), 1e-6)
