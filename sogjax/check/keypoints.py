"""Keypoint files beside a recording: what is there, whether the cameras agree about the people, and see them."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np
from jaxtyping import Bool, Float, UInt8

from sogjax.check.findings import Finding
from sogjax.check.pictures import Clip, Picture
from sogjax.errors import InputError, counted, listed
from sogjax.io.keypoints.load import Keypoints, load_keypoints
from sogjax.io.recording import Recording
from sogjax.scene.background_difference import same_exposure
from sogjax.scene.visual_hull import resized
from sogjax.search.keypoint_people import SAME_PERSON, triangulated_people
from sogjax.search.seen_people import FEWEST_POINTS, seen_share
from sogjax.search.triangulation import Rays, distances, poses_of, rays_of


def keypoint_findings(clip: Clip, backgrounds: Mapping[int, Picture]) -> list[Finding]:
    """What there is of keypoints, what of it cannot be used, and whose keypoints are not of these pictures.

    Of the clip, 30 frames are compared at most; `backgrounds` are the pictures of the empty scene by camera.
    """
    recording, start, frames = clip.recording, clip.frame_number(0), clip.num_frames
    try:
        keypoints = load_keypoints(recording)
    except InputError as error:
        return [Finding("warning", "keypoints", str(error))]
    if keypoints is None:
        return []
    findings = [Finding("warning", "keypoints", warning) for warning in keypoints.warnings]
    chosen = np.unique(np.linspace(start, start + frames - 1, min(frames, 30)).astype(int))
    shares = agreement(keypoints, recording, chosen)
    wrong = suspects(keypoints.cameras, shares)
    for name in wrong:
        share = 100 * shares[keypoints.cameras.index(name)]
        what = f"only {share:.0f} % of the keypoints of {name} are on the person whom the other cameras see"
        cause = "files of another camera, clip or picture size, or a camera whose calibration or time is wrong"
        remedy = f"run the detector on the recorded pictures of {name}, or remove its files"
        findings.append(Finding("warning", "keypoints", what, cause, remedy, (name,)))
    unseen = [] if wrong else unseen_people_findings(keypoints, clip, backgrounds, chosen.tolist())
    findings += unseen
    if not wrong and not unseen:
        seen = 100.0 * (keypoints.confidence > 0.0).any((2, 3)).mean()
        found = f"{keypoints.scheme.name} of {listed(keypoints.seeing)}: somebody in {seen:.0f} % of the pictures"
        findings.append(Finding("ok", "keypoints", found))
    return findings


def agreement(
    keypoints: Keypoints, recording: Recording, frames: Sequence[int] | np.ndarray
) -> Float[np.ndarray, "camera"]:
    """The share of each camera's keypoints on the person whom all see together; NaN where it has fewer than 20.

    Only those with a confidence of 0.3 or more count.
    """
    rig = recording.rig
    some = Keypoints(
        keypoints.scheme, keypoints.cameras, keypoints.points[:, np.asarray(frames, int) - recording.first_frame]
    )
    points = triangulated_people(some, rig).points[:, 0]
    cameras, count, persons, number = some.confidence.shape
    rays = rays_of(rig, some.pixels.reshape(cameras, -1, 2)).reshape(cameras, count, persons, number, 2)
    near, total = np.zeros(cameras), np.zeros(cameras)
    for camera, pose in enumerate(poses_of(rig)):
        for frame in range(count):
            known = np.isfinite(points[frame]).all(-1)
            weights = some.confidence[camera, frame] * known
            views = Rays(np.repeat(pose[None], persons, axis=0), rays[camera, frame], weights.astype(float))
            misses = distances(views, np.where(known[:, None], points[frame], 0.0))
            sure = weights >= 0.3
            hits = ((misses < SAME_PERSON) & sure).sum(-1)
            best = int(hits.argmax())
            near[camera] += hits[best]
            total[camera] += sure[best].sum()
    return np.where(total >= 20, near / np.maximum(total, 1.0), np.nan)


def suspects(cameras: Sequence[str], shares: Float[np.ndarray, "camera"]) -> list[str]:
    """Cameras with few keypoints on the person where most others have many; of two nobody can tell which is wrong."""
    told = shares[np.isfinite(shares)]
    if len(told) < 3 or np.median(told) < 0.6:
        return []
    return [name for name, share in zip(cameras, shares, strict=True) if share < 0.3]


MOST_PEOPLE = 4
CHANGED = 12.0
"""Grey levels, after a blur, from which on a pixel is not the background."""
UNSEEN = 0.4
"""Median share of keypoints on what is not the background below which nobody is there; people have 0.9."""
FEWEST_FRAMES = 5
MOVED = 0.5
"""Metres: without a picture of the empty scene, who moves less may be the background that was learnt."""


def unseen_people_findings(
    keypoints: Keypoints, clip: Clip, backgrounds: Mapping[int, Picture], frames: Sequence[int]
) -> list[Finding]:
    """People of the keypoints on whom cameras agree, and who are seen in no pictures of the frames (the recording's).

    The frames are some of the clip's; `backgrounds` are the pictures of the empty scene by camera.
    """
    rig, rows = clip.recording.rig, np.asarray(frames, int) - clip.recording.first_frame
    some = Keypoints(keypoints.scheme, keypoints.cameras, keypoints.points[:, rows])
    most = min(some.points.shape[2], MOST_PEOPLE)
    points = np.asarray(triangulated_people(some, rig, most).points, float)
    masks = _masks(clip, backgrounds, [frame - clip.frame_number(0) for frame in frames])
    sizes = [grey.shape[:0:-1] for grey in clip.grey]
    cameras = {k: resized(rig.camera(name), sizes[k]) for k, name in enumerate(rig.names)}
    plates = len(backgrounds) == len(rig)
    unseen, num_people = [], 0
    for person in np.moveaxis(points, 1, 0):
        there = [k for k in range(len(frames)) if np.isfinite(person[k]).all(-1).sum() >= FEWEST_POINTS]
        if len(there) < min(FEWEST_FRAMES, len(frames)):
            continue
        num_people += 1
        places = np.array([np.nanmedian(person[k], axis=0) for k in there])
        if not plates and np.linalg.norm(np.ptp(places, axis=0)) < MOVED:
            continue
        shares = [seen_share(person[k], cameras, masks[k]) for k in there]
        if np.nanmedian([*shares, np.nan] if not np.isfinite(shares).any() else shares) < UNSEEN:
            unseen.append((np.median(places, axis=0), float(np.nanmedian(shares))))
    return [_finding(place, share, num_people) for place, share in unseen]


def _finding(place: Float[np.ndarray, "3"], share: float, num_people: int) -> Finding:
    where = ", ".join(f"{x:.1f}" for x in place)
    what = (
        f"the keypoint files show {counted(num_people, 'person', 'people')}, of whom the one about ({where}) m is "
        f"never in the pictures ({share:.0%} of its keypoints are on what is not the background)"
    )
    cause = "a mirror, a poster or furniture that the detector took for somebody, or files of another clip"
    return Finding("warning", "keypoints", what, cause, "take this person out of the files, or run the detector again")


def _masks(
    clip: Clip, backgrounds: Mapping[int, Picture], rows: Sequence[int]
) -> list[dict[int, Bool[np.ndarray, "_rows _columns"]]]:
    """What is not the background in some rows of the clip, by camera that is present."""
    empty = {k: _empty(grey[clip.present[k]], backgrounds.get(k)) for k, grey in enumerate(clip.grey)}
    smooth = lambda picture: cv2.GaussianBlur(picture.astype(np.float32), (0, 0), 1.5)
    return [
        {
            k: np.abs(smooth(grey[row]) - smooth(empty[k])) > CHANGED
            for k, grey in enumerate(clip.grey)
            if clip.present[k, row]
        }
        for row in rows
    ]


def _empty(
    grey: UInt8[np.ndarray, "frame _rows _columns"], background: Picture | None
) -> Float[np.ndarray, "_rows _columns"]:
    """The empty scene in grey: the picture of it, exposed as the clip, or else the clip's median."""
    usual = np.median(grey[:: max(len(grey) // 20, 1)], axis=0) if len(grey) else np.zeros(grey.shape[1:])
    if background is None:
        return usual
    small = cv2.resize(cv2.cvtColor(background, cv2.COLOR_BGR2GRAY), grey.shape[:0:-1], interpolation=cv2.INTER_AREA)
    seen, empty = (np.repeat(part[..., None], 3, axis=-1) for part in (usual, small.astype(float)))
    gain, offset = same_exposure(seen, empty, 1)
    return gain[0] * small + offset[0]
