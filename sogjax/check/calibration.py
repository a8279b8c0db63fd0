"""Whether calibration and pictures belong together, and if not, what was probably mixed up."""

from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from sogjax.check.agreement import Misfit, MomentHull, camera_misfits, hulls_of, mean_coverage
from sogjax.check.findings import Finding, listed
from sogjax.check.hypotheses import exchanged_rig, mirrored_rig
from sogjax.check.silhouettes import Moment
from sogjax.io.calibration.rig import CameraRig

POOR = 0.6
"""Mean coverage below which the calibration as a whole is doubted."""
BETTER = 0.25
"""How much another calibration must raise the mean coverage to be named."""
MOST_SUSPECTS = 4
"""Cameras among which a swap is looked for."""


def calibration_findings(
    rig: CameraRig, photographed: Sequence[Moment], filmed: Sequence[Moment]
) -> tuple[list[Finding], dict[int, Misfit]]:
    """What the silhouettes show, and by camera how well it fits (from example poses where there are any)."""
    looks = [("example poses", photographed, "the calibration"), ("videos", filmed, "the calibration or the video")]
    findings: list[Finding] = []
    fits: dict[int, Misfit] = {}
    told: set[str] = set()
    compared = []
    for label, moments, what in looks:
        hulls = hulls_of(rig, moments)
        if not hulls:
            continue
        compared.append(label)
        misfits = camera_misfits(hulls)
        fits = fits or misfits
        for finding in _told(rig, moments, hulls, misfits, label, what):
            if finding.what.split(" (")[0] not in told:
                told.add(finding.what.split(" (")[0])
                findings.append(finding)
    if not compared:
        what = "the calibration cannot be checked against silhouettes: at least three cameras need one"
        remedy = (
            "for this check add masks, or pictures of the empty scene as background/CAMERA.jpg, of more cameras; "
            "tracking does without them"
        )
        return [Finding("note", "calibration", what, "", remedy)], {}
    if not findings:
        lowest = min(fits.values(), key=lambda fit: fit.coverage).coverage
        what = f"the silhouettes of all cameras agree ({' and '.join(compared)}; at least {100 * lowest:.0f} %)"
        findings.append(Finding("ok", "calibration", what))
    return findings, fits


def _told(
    rig: CameraRig,
    moments: Sequence[Moment],
    hulls: Sequence[MomentHull],
    misfits: Mapping[int, Misfit],
    label: str,
    what: str,
) -> list[Finding]:
    wrong = {camera: misfit for camera, misfit in misfits.items() if misfit.is_wrong}
    if not wrong:
        return []
    usual = mean_coverage(hulls)
    if usual < POOR and mean_coverage(hulls_of(mirrored_rig(rig), moments)) > usual + BETTER:
        shown = f"the pictures fit a mirrored world, not this one ({label})"
        cause = "a calibration that changed between left-handed and right-handed axes, or pictures that are mirrored"
        remedy = "export the calibration for right-handed axes (OpenCV's cameras), or undo the mirroring of the videos"
        return [Finding("warning", "calibration", shown, cause, remedy)]
    exchanged = _exchanged(rig, moments, hulls, wrong)
    if exchanged is not None:
        names = tuple(rig.names[k] for k in exchanged)
        shown = f"{names[0]} and {names[1]} are exchanged: with their names swapped, the silhouettes agree ({label})"
        rest = {camera: misfit for camera, misfit in wrong.items() if camera not in exchanged}
        swapped = Finding("warning", "calibration", shown, "files under the wrong names", "rename them", names)
        return [swapped, *_each(rig, rest, label, what)]
    if 2 * len(wrong) > len(misfits) and len(misfits) > 3:
        shown = f"the silhouettes of {listed(rig.names[k] for k in wrong)} contradict the others' ({label})"
        cause = "a calibration from another day or set-up, or with axes other than OpenCV's"
        names = tuple(rig.names[k] for k in wrong)
        return [Finding("warning", "calibration", shown, cause, "calibrate the cameras where they stood", names)]
    return _each(rig, wrong, label, what)


def _each(rig: CameraRig, wrong: Mapping[int, Misfit], label: str, what: str) -> list[Finding]:
    findings = []
    for camera, misfit in wrong.items():
        name = rig.names[camera]
        shown = f"{name} does not agree with the others: {_how(misfit)} ({label})"
        cause = f"{what} of {name} is wrong: the camera was moved or turned, or the file is another camera's"
        remedy = f"calibrate {name} again, or leave it out with `cameras:` in recording.yaml"
        findings.append(Finding("warning", "calibration", shown, cause, remedy, (name,)))
    return findings


def _how(misfit: Misfit) -> str:
    parts = [f"{100 * misfit.coverage:.0f} % of its silhouette is confirmed"]
    if np.isfinite(misfit.away) and misfit.away > 0:
        parts.append(f"it lies {misfit.away:.1f} degrees away")
    if misfit.turned:
        parts.append(f"turned by {abs(misfit.turned):.0f} degrees")
    return ", ".join(parts)


def _exchanged(
    rig: CameraRig, moments: Sequence[Moment], hulls: Sequence[MomentHull], wrong: Mapping[int, Misfit]
) -> tuple[int, int] | None:
    """Two cameras with whose calibrations exchanged the silhouettes agree, one of them among the wrong ones."""
    by_coverage = sorted(wrong, key=lambda camera: wrong[camera].coverage)[:MOST_SUSPECTS]
    usual = mean_coverage(hulls)
    best, found = usual + (1.0 - usual) / 2.0, None
    for pair in combinations(sorted(by_coverage), 2):
        sizes = {rig.image_size(rig.names[camera]) for camera in pair}
        if len(sizes) > 1:
            continue
        covered = mean_coverage(hulls_of(exchanged_rig(rig, *pair), moments))
        if covered > best:
            best, found = covered, pair
    return found
