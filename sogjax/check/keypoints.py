"""Keypoint files beside a recording: what is there, and whether the cameras agree about the people."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from sogjax.check.findings import Finding, listed
from sogjax.check.pictures import Clip, Picture
from sogjax.check.unseen_people import unseen_people_findings
from sogjax.errors import InputError
from sogjax.io.keypoints.load import Keypoints, load_keypoints
from sogjax.io.recording import Recording
from sogjax.search.keypoint_people import SAME_PERSON, triangulated_people
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
