"""Exposure and white balance: how bright and how coloured each camera shows the same subject."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sogjax.check.findings import Finding
from sogjax.check.silhouettes import Moment, Picture

BRIGHTER = 1.3
"""Ratio of values to the median camera's above which a camera counts as exposed differently."""
TINTED = 1.2
"""The same for red or blue against green."""
ROOM_FACTOR = 1.25
"""Both thresholds are so much wider where whole pictures are compared: cameras see different parts of a room."""
FEWEST = 3
"""With two cameras that differ, nothing tells which is wrong."""
CHANGED = 1.2
"""Ratio of values between a camera's pictures above which its exposure counts as changed."""
SATURATED = (5, 250)
SCATTER = 0.25
"""Logarithms of ratios may be so far from their median by noise."""
CLOSEST = 0.5
"""Share of the pixels of a static camera's two pictures that show the same, at least."""


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
    by_moment = [_colors(moment, count, of_subject) for moment in moments]
    relative = [c - np.nanmedian(c, axis=0) for c in by_moment if np.isfinite(c[:, 0]).sum() >= fewest]
    if not relative:
        return Exposure(np.full((count, 3), np.nan), of_subject)
    known = np.isfinite(relative).sum(axis=0)
    mean = np.nansum(relative, axis=0) / np.maximum(known, 1)
    return Exposure(np.exp(np.where(known > 0, mean, np.nan)), of_subject)


def _colors(moment: Moment, count: int, of_subject: bool) -> Float[np.ndarray, "camera 3"]:
    """The logarithms of mean blue, green and red; NaN where a camera does not show it."""
    colors = np.full((count, 3), np.nan)
    for camera in moment.masks if of_subject else moment.pictures:
        picture = moment.pictures[camera]
        pixels = picture[moment.masks[camera]] if of_subject else picture.reshape(-1, 3)
        colors[camera] = np.log(np.maximum(pixels.mean(axis=0), 1.0))
    return colors


def exposure_findings(names: tuple[str, ...], found: Exposure, label: str) -> list[Finding]:
    """Cameras that show things brighter, darker or in different colours than the others."""
    known = int((~np.isnan(found.gains).any(axis=1)).sum())
    if known < FEWEST:
        return []
    wider = 1.0 if found.of_subject else ROOM_FACTOR
    of = "the subject" if found.of_subject else "its pictures as a whole"
    findings = []
    for name, gains, brightness in zip(names, found.gains, found.brightness, strict=True):
        if np.isnan(gains).any():
            continue
        balance = gains[[0, 2]] / gains[1]
        if not 1.0 / (wider * BRIGHTER) <= brightness <= wider * BRIGHTER:
            what = f"{name} shows {of} at {brightness:.2f} times the values of the median camera ({label})"
            findings.append(_finding(name, what, "another exposure time, gain or aperture"))
        elif max(balance.max(), (1.0 / balance).max()) > wider * TINTED:
            what = f"{name} shows {of} in other colours, blue x{balance[0]:.2f} and red x{balance[1]:.2f} ({label})"
            findings.append(_finding(name, what, "another white balance"))
    if not findings:
        spread = float(np.nanmax(found.brightness) / np.nanmin(found.brightness))
        who = "the cameras" if known == len(names) else f"the {known} of {len(names)} cameras that could be compared"
        what = f"{who} show {of if found.of_subject else 'their pictures'} alike"
        findings.append(Finding("ok", "exposure", f"{what}, brightest to darkest {spread:.2f} ({label})"))
    return findings


def _finding(name: str, what: str, cause: str) -> Finding:
    remedy = "set all cameras to the same manual values, or correct the videos; the actor's colours do not fit this one"
    return Finding("warning", "exposure", what, cause, remedy, (name,))


def change_findings(
    names: tuple[str, ...], references: Mapping[int, tuple[str, Picture]], filmed: Mapping[int, Picture]
) -> list[Finding]:
    """Cameras whose video (one picture of each) is exposed differently from a still of the same place."""
    findings = []
    for camera, (label, picture) in references.items():
        gains = same_place_gains(picture, filmed[camera]) if camera in filmed else None
        if gains is None:
            continue
        low, high = float(gains.min()), float(gains.max())
        if low < 1.0 / CHANGED or high > CHANGED:
            shown = f"{low:.2f}" if high < low * TINTED else f"{low:.2f} to {high:.2f} (by colour)"
            what = f"the values in the video of {names[camera]} are {shown} times those in its {label}"
            remedy = "fix exposure and white balance, and take all pictures of a session with the same settings"
            cause = "automatic exposure, or settings changed in between"
            findings.append(Finding("warning", "exposure", what, cause, remedy, (names[camera],)))
    return findings


def same_place_gains(before: Picture, after: Picture) -> Float[np.ndarray, "3"] | None:
    """The ratios of blue, green and red of two pictures of a static camera; None where they show other places."""
    if before.shape != after.shape:
        return None
    a, b = before.reshape(-1, 3).astype(float), after.reshape(-1, 3).astype(float)
    low, high = SATURATED
    usable = ((a > low) & (a < high) & (b > low) & (b < high)).all(axis=1)
    if usable.mean() < CLOSEST:
        return None
    ratios = np.log(b[usable] / a[usable])
    middle = np.median(ratios, axis=0)
    alike = (np.abs(ratios - middle) < SCATTER).all(axis=1).mean()
    return np.exp(middle) if alike > CLOSEST else None
