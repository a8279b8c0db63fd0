"""Whether cameras show what they should: the place of their own still pictures, and the subject as bright as others."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float

from sogjax.check.findings import Finding
from sogjax.check.pictures import Moment, Picture
from sogjax.io.recording import Recording
from sogjax.scene.plates import FittedPlate

SAME_PLACE = 0.55
"""Correlation of two pictures' fine structure above which they show the same place."""
TINTED = 1.2
"""Ratio of red or blue against green to the median camera's above which a camera counts as tinted."""
FEWEST = 3
"""With two cameras that differ, nothing tells which is wrong."""

References = Mapping[int, tuple[str, Picture]]
"""A still picture of what each camera sees, and what kind of picture it is."""


def references_of(backgrounds: Mapping[int, Picture], photographed: Sequence[Moment]) -> dict[int, tuple[str, Picture]]:
    """The empty scene of each camera, else its example pose."""
    found = {
        camera: ("example pose", picture) for moment in photographed[:1] for camera, picture in moment.pictures.items()
    }
    return found | {camera: ("background picture", picture) for camera, picture in backgrounds.items()}


def place_findings(names: tuple[str, ...], references: References, filmed: Mapping[int, Picture]) -> list[Finding]:
    """Videos (by camera a picture of each) that show what another camera's still pictures show, or what none shows."""
    likeness = _place_likeness(references, filmed)
    findings, paired = [], set()
    for camera, row in likeness.items():
        if row[camera] >= SAME_PLACE or camera in paired:
            continue
        other = max(row, key=row.__getitem__)
        label = references[camera][0]
        if row[other] < max(SAME_PLACE, row[camera] + 0.2):
            what = f"the video of {names[camera]} does not show the place of its {label} (likeness {row[camera]:.2f})"
            cause = "the camera was moved in between, or one of the files belongs to another camera"
            remedy = f"compare both; take the {label} again, or rename the file"
            findings.append(Finding("warning", "files", what, cause, remedy, (names[camera],)))
            continue
        back = likeness.get(other, {}).get(camera, 0.0)
        paired |= {camera, other} if back >= SAME_PLACE else {camera}
        what = f"the video of {names[camera]} shows what the {references[other][0]} of {names[other]} shows"
        what += ", and the other way round" if back >= SAME_PLACE else ""
        cause, remedy = "videos under the wrong names", f"swap the names of {names[camera]} and {names[other]}"
        findings.append(Finding("warning", "files", what, cause, remedy, (names[camera], names[other])))
    if likeness and not findings:
        findings.append(Finding("ok", "files", "every video shows the place that its camera's still pictures show"))
    return findings


def _place_likeness(references: References, filmed: Mapping[int, Picture]) -> dict[int, dict[int, float]]:
    """How alike the video's picture of each camera with a reference is with the reference of every camera."""
    structures = {camera: _structure(picture) for camera, (_, picture) in references.items()}
    rows = {}
    for camera in references.keys() & filmed.keys():
        own = _structure(filmed[camera])
        rows[camera] = {other: float((own * reference).mean()) for other, reference in structures.items()}
    return rows


def _structure(picture: Picture) -> Float[np.ndarray, "h w"]:
    """Edges and patterns of a picture, whatever its exposure: mean 0, variance 1."""
    grey = cv2.resize(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), (96, 72), interpolation=cv2.INTER_AREA)
    light = np.log1p(grey.astype(np.float32))
    fine = light - cv2.GaussianBlur(light, (0, 0), 6.0)
    return (fine - fine.mean()) / max(float(fine.std()), 1e-6)


def plate_findings(recording: Recording, plates: Mapping[int, FittedPlate]) -> list[Finding]:
    """Pictures of the empty scene (by camera, as held against the video) that are not what the video shows.

    Those that are only brighter or darker are told by `change_findings`.
    """
    findings = []
    for camera, plate in plates.items():
        name = recording.rig.names[camera]
        path = recording.background[name]
        scale = recording.rig.image_size(name)[0] / plate.picture.shape[1]
        said = replace(plate, shift=(scale * plate.shift[0], scale * plate.shift[1])).said(str(path))
        if said is not None and (plate.pixels or plate.other or not plate.fits):
            what, _, remedy = said.rpartition("; ")
            cause = "the camera was touched in between" if plate.pixels else ""
            findings.append(Finding("warning", "files", what, cause, remedy, (name,)))
    return findings


def change_findings(names: tuple[str, ...], references: References, filmed: Mapping[int, Picture]) -> list[Finding]:
    """Cameras whose video (one picture of each) is exposed differently from a still of the same place, by a fifth."""
    findings = []
    for camera, (label, picture) in references.items():
        gains = _same_place_gains(picture, filmed[camera]) if camera in filmed else None
        if gains is None:
            continue
        low, high = float(gains.min()), float(gains.max())
        if low < 1.0 / 1.2 or high > 1.2:
            shown = f"{low:.2f}" if high < low * TINTED else f"{low:.2f} to {high:.2f} (by colour)"
            what = f"the values in the video of {names[camera]} are {shown} times those in its {label}"
            remedy = "fix exposure and white balance, and take all pictures of a session with the same settings"
            cause = "automatic exposure, or settings changed in between"
            findings.append(Finding("warning", "exposure", what, cause, remedy, (names[camera],)))
    return findings


def _same_place_gains(before: Picture, after: Picture) -> Float[np.ndarray, "3"] | None:
    """The ratios of blue, green and red of two pictures of a static camera; None where they show other places.

    Half of the pixels at least must neither be saturated nor lie farther from the median than noise does.
    """
    if before.shape != after.shape:
        return None
    a, b = before.reshape(-1, 3).astype(float), after.reshape(-1, 3).astype(float)
    usable = ((np.minimum(a, b) > 5) & (np.maximum(a, b) < 250)).all(axis=1)
    if usable.mean() < 0.5:
        return None
    ratios = np.log(b[usable] / a[usable])
    middle = np.median(ratios, axis=0)
    alike = (np.abs(ratios - middle) < 0.25).all(axis=1).mean()
    return np.exp(middle) if alike > 0.5 else None


@dataclass(frozen=True)
class Exposure:
    """Gains of the cameras, in values of the pictures (sRGB, not light)."""

    gains: Float[np.ndarray, "camera 3"]
    """Blue, green, red in units of the median camera's; NaN where a camera does not show it."""
    of_subject: bool
    """Whether the subject was compared; else whole pictures."""

    @property
    def brightness(self) -> Float[np.ndarray, "camera"]:
        """The geometric mean of a camera's gains."""
        return np.exp(np.log(self.gains).mean(axis=1))


def exposure(moments: Sequence[Moment], count: int) -> Exposure:
    """The gains of `count` cameras, from the subject where enough are known to show it, else from whole pictures."""
    fewest = min(FEWEST, count)
    of_subject = any(len(moment.masks) >= fewest for moment in moments)
    by_moment = [_log_colors(moment, count, of_subject) for moment in moments]
    relative = [c - np.nanmedian(c, axis=0) for c in by_moment if np.isfinite(c[:, 0]).sum() >= fewest]
    if not relative:
        return Exposure(np.full((count, 3), np.nan), of_subject)
    known = np.isfinite(relative).sum(axis=0)
    mean = np.nansum(relative, axis=0) / np.maximum(known, 1)
    return Exposure(np.exp(np.where(known > 0, mean, np.nan)), of_subject)


def _log_colors(moment: Moment, count: int, of_subject: bool) -> Float[np.ndarray, "camera 3"]:
    """The logarithms of mean blue, green and red; NaN where a camera does not show it."""
    colors = np.full((count, 3), np.nan)
    for camera in moment.masks if of_subject else moment.pictures:
        picture = moment.pictures[camera]
        pixels = picture[moment.masks[camera]] if of_subject else picture.reshape(-1, 3)
        colors[camera] = np.log(np.maximum(pixels.mean(axis=0), 1.0))
    return colors


def exposure_findings(names: tuple[str, ...], found: Exposure, label: str) -> list[Finding]:
    """Cameras that show things brighter or darker than the others by 30 %, or in different colours.

    Thresholds are a quarter wider where whole pictures are compared: cameras see different parts of a room.
    """
    known = int((~np.isnan(found.gains).any(axis=1)).sum())
    if known < FEWEST:
        return []
    wider = 1.0 if found.of_subject else 1.25
    of = "the subject" if found.of_subject else "its pictures as a whole"
    remedy = "set all cameras to the same manual values, or correct the videos; the actor's colours do not fit this one"
    findings = []
    for name, gains, brightness in zip(names, found.gains, found.brightness, strict=True):
        if np.isnan(gains).any():
            continue
        balance = gains[[0, 2]] / gains[1]
        if not 1.0 / (wider * 1.3) <= brightness <= wider * 1.3:
            what = f"{name} shows {of} at {brightness:.2f} times the values of the median camera ({label})"
            cause = "another exposure time, gain or aperture"
        elif max(balance.max(), (1.0 / balance).max()) > wider * TINTED:
            what = f"{name} shows {of} in other colours, blue x{balance[0]:.2f} and red x{balance[1]:.2f} ({label})"
            cause = "another white balance"
        else:
            continue
        findings.append(Finding("warning", "exposure", what, cause, remedy, (name,)))
    if not findings:
        spread = float(np.nanmax(found.brightness) / np.nanmin(found.brightness))
        who = "the cameras" if known == len(names) else f"the {known} of {len(names)} cameras that could be compared"
        what = f"{who} show {of if found.of_subject else 'their pictures'} alike"
        findings.append(Finding("ok", "exposure", f"{what}, brightest to darkest {spread:.2f} ({label})"))
    return findings
