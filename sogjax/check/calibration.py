"""Whether calibration and pictures belong together, and if not, what was probably mixed up."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

import jax.numpy as jnp
import numpy as np

from sogjax.check.agreement import Misfit, MomentHull, camera_misfits, hulls_of, mean_coverage
from sogjax.check.findings import Finding
from sogjax.check.pictures import Moment
from sogjax.errors import listed
from sogjax.io.calibration.rig import CameraRig

FEWEST_TO_TELL = 4
"""Cameras: of three, a turned one puts the others beside its hull, too."""
TURNED, CLEARLY, IN_PLACE = 0.4, 1.5, 0.15
"""Degrees from which on a camera may be turned; how many times as far as any other it must be; and how far the usual
one is at most. Cameras in place have 0.0, beside one that is turned 0.3; that has 0.45 to 0.65 of 0.7 degrees."""


def unit_rig(rig: CameraRig, scale: float) -> CameraRig:
    """The rig with `scale` (metres) as its unit of length, so that a wrong unit does no harm."""
    poses = np.array(rig.cameras.camera_from_world, float)
    poses[:, :3, 3] /= scale
    return _with_poses(rig, poses)


def mirrored_rig(rig: CameraRig) -> CameraRig:
    """The rig in a world whose x axis is reversed, and the cameras' x axes with it, so that rotations stay such."""
    flip = np.diag([-1.0, 1.0, 1.0, 1.0])
    return _with_poses(rig, flip @ np.asarray(rig.cameras.camera_from_world, float) @ flip)


def _exchanged_rig(rig: CameraRig, first: int, second: int) -> CameraRig:
    """The rig with the calibrations of two cameras exchanged; their names keep their order."""
    names = list(rig.names)
    names[first], names[second] = names[second], names[first]
    return CameraRig(rig.names, rig.select(names).cameras)


def _with_poses(rig: CameraRig, poses: np.ndarray) -> CameraRig:
    like = rig.cameras.camera_from_world.dtype
    return CameraRig(rig.names, replace(rig.cameras, camera_from_world=jnp.asarray(poses, like)))


def calibration_findings(
    rig: CameraRig, photographed: Sequence[Moment], filmed: Sequence[Moment]
) -> tuple[list[Finding], dict[int, Misfit]]:
    """What the silhouettes show, and by camera how well it fits (from example poses where there are any)."""
    findings: dict[str, Finding] = {}
    fits: dict[int, Misfit] = {}
    compared = []
    for label, moments, blamed in (
        ("example poses", photographed, "the calibration"),
        ("videos", filmed, "the calibration or the video"),
    ):
        if hulls := hulls_of(rig, moments):
            compared.append(label)
            misfits = camera_misfits(hulls)
            fits = fits or misfits
            for finding in _contradictions(rig, moments, hulls, misfits, label, blamed):
                findings.setdefault(finding.what.split(" (")[0], finding)
    if not compared:
        what = "the calibration cannot be checked against silhouettes: at least three cameras need one"
        remedy = (
            "for this check add masks, or pictures of the empty scene as background/CAMERA.jpg, of more cameras; "
            "tracking does without them"
        )
        return [Finding("note", "calibration", what, "", remedy)], {}
    if findings:
        return [*findings.values()], fits
    lowest = min(fit.coverage for fit in fits.values())
    what = f"the silhouettes of all cameras agree ({' and '.join(compared)}; at least {100 * lowest:.0f} %)"
    return [Finding("ok", "calibration", what)], fits


def _contradictions(
    rig: CameraRig,
    moments: Sequence[Moment],
    hulls: Sequence[MomentHull],
    misfits: Mapping[int, Misfit],
    label: str,
    blamed: str,
) -> list[Finding]:
    """Silhouettes that contradict the others, by the first cause that explains them.

    Another calibration is named where it raises the mean coverage by 0.25; the whole world is doubted below 0.6.
    """
    wrong = {camera: misfit for camera, misfit in misfits.items() if misfit.is_wrong}
    if not wrong:
        return _slightly_turned(rig, misfits, label)
    covered = mean_coverage(hulls)
    if covered < 0.6 and mean_coverage(hulls_of(mirrored_rig(rig), moments)) > covered + 0.25:
        shown = f"the pictures fit a mirrored world, not this one ({label})"
        cause = "a calibration that changed between left-handed and right-handed axes, or pictures that are mirrored"
        remedy = "export the calibration for right-handed axes (OpenCV's cameras), or undo the mirroring of the videos"
        return [Finding("warning", "calibration", shown, cause, remedy)]
    exchanged = _exchanged(rig, moments, covered, wrong)
    if exchanged is not None:
        names = tuple(rig.names[k] for k in exchanged)
        shown = f"{names[0]} and {names[1]} are exchanged: with their names swapped, the silhouettes agree ({label})"
        rest = {camera: misfit for camera, misfit in wrong.items() if camera not in exchanged}
        swapped = Finding("warning", "calibration", shown, "files under the wrong names", "rename them", names)
        return [swapped, *_each(rig, rest, label, blamed)]
    if 2 * len(wrong) > len(misfits) and len(misfits) > 3:
        names = tuple(rig.names[k] for k in wrong)
        shown = f"the silhouettes of {listed(names)} contradict the others' ({label})"
        cause = "a calibration from another day or set-up, or with axes other than OpenCV's"
        return [Finding("warning", "calibration", shown, cause, "calibrate the cameras where they stood", names)]
    return _each(rig, wrong, label, blamed)


def _slightly_turned(rig: CameraRig, misfits: Mapping[int, Misfit], label: str) -> list[Finding]:
    """One camera among four or more whose silhouette is a little beside the hull in which all the others lie."""
    by_away = sorted(misfits, key=lambda camera: -misfits[camera].away)  # none is NaN: that would be wrong
    if len(by_away) < FEWEST_TO_TELL:
        return []
    first, second = misfits[by_away[0]].away, misfits[by_away[1]].away
    usual = float(np.median([misfits[camera].away for camera in by_away[1:]]))
    if not (first >= TURNED and first > CLEARLY * second and usual <= IN_PLACE):
        return []
    name = rig.names[by_away[0]]
    shown = f"{name} is turned by about {first:.1f} degrees against what the others see ({label})"
    cause = f"the camera {name} was touched after the calibration"
    return [Finding("warning", "calibration", shown, cause, f"calibrate {name} again, or try `sogjax adjust`", (name,))]


def _each(rig: CameraRig, wrong: Mapping[int, Misfit], label: str, blamed: str) -> list[Finding]:
    findings = []
    for camera, misfit in wrong.items():
        name = rig.names[camera]
        how = [f"{100 * misfit.coverage:.0f} % of its silhouette is confirmed"]
        how += [f"it lies {misfit.away:.1f} degrees away"] if np.isfinite(misfit.away) and misfit.away > 0 else []
        how += [f"turned by {abs(misfit.turned):.0f} degrees"] if misfit.turned else []
        shown = f"{name} does not agree with the others: {', '.join(how)} ({label})"
        cause = f"{blamed} of {name} is wrong: the camera was moved or turned, or the file is another camera's"
        remedy = f"calibrate {name} again, or leave it out with `cameras:` in recording.yaml"
        findings.append(Finding("warning", "calibration", shown, cause, remedy, (name,)))
    return findings


def _exchanged(
    rig: CameraRig, moments: Sequence[Moment], covered: float, wrong: Mapping[int, Misfit]
) -> tuple[int, int] | None:
    """Two of the four worst cameras with whose calibrations exchanged the silhouettes agree."""
    suspects = sorted(wrong, key=lambda camera: wrong[camera].coverage)[:4]
    best, found = covered + (1.0 - covered) / 2.0, None
    for pair in combinations(sorted(suspects), 2):
        if rig.image_size(rig.names[pair[0]]) == rig.image_size(rig.names[pair[1]]):
            swapped = mean_coverage(hulls_of(_exchanged_rig(rig, *pair), moments))
            best, found = (swapped, pair) if swapped > best else (best, found)
    return found
