"""Who is who among the people that detectors found: across cameras by geometry, through time by nearness."""

import numpy as np
from jaxtyping import Float, Int

from sogjax.io.calibration.rig import CameraRig
from sogjax.io.keypoints.load import Keypoints
from sogjax.search.triangulation import (
    TOLERANCE,
    Rays,
    Triangulated,
    all_pairs,
    distances,
    points_of_pairs,
    poses_of,
    rays_of,
    triangulated,
)

SAME_PERSON = 0.15
"""Metres from a camera's rays within which its person is the same, on average over the keypoints."""
LEAST_SHARE = 0.3
"""Share of a person's confidence that must speak for it."""
MOST_PAIRS = 300
"""Pairs of people that are tried in a frame; of more, so many are drawn."""
LEAST_POINTS = 4
"""Keypoints that make a person."""


def triangulated_people(
    keypoints: Keypoints, rig: CameraRig, num_people: int = 1, tolerance: float = TOLERANCE
) -> Triangulated:
    """The keypoints of people in the world: points (frame, person, keypoint, 3).

    A person is the pair of people of two cameras whom most other cameras confirm. The order of people follows each of
    them through the frames, as far as they are nearest to where they were.
    """
    cameras, frames, persons, count, _ = keypoints.points.shape
    assert keypoints.cameras == rig.names
    rays = rays_of(rig, keypoints.pixels.reshape(cameras, -1, 2)).reshape(cameras, frames, persons, count, 2)
    weights = keypoints.confidence.astype(float)
    poses = poses_of(rig)
    seen = np.zeros((num_people, cameras, frames, count, 2))
    sure = np.zeros((num_people, cameras, frames, count))
    for frame in range(frames):
        chosen = associated(poses, rays[:, frame], weights[:, frame], num_people, np.random.default_rng(frame))
        for one, persons_of in enumerate(chosen):
            for camera in np.flatnonzero(persons_of >= 0):
                seen[one, camera, frame] = rays[camera, frame, persons_of[camera]]
                sure[one, camera, frame] = weights[camera, frame, persons_of[camera]]
    found = [
        triangulated(Rays(poses, seen[one].reshape(cameras, -1, 2), sure[one].reshape(cameras, -1)), tolerance)
        for one in range(num_people)
    ]
    points = np.stack([one.points.reshape(frames, count, 3) for one in found], axis=1)
    order = _followed(points)
    along = lambda values: np.take_along_axis(values, order.reshape(*order.shape, *[1] * (values.ndim - 2)), axis=1)
    by_person = lambda name: along(np.stack([getattr(one, name).reshape(frames, count) for one in found], axis=1))
    return Triangulated(along(points), by_person("num_cameras"), by_person("errors"))


def associated(
    poses: Float[np.ndarray, "camera 3 4"],
    rays: Float[np.ndarray, "camera person keypoint 2"],
    weights: Float[np.ndarray, "camera person keypoint"],
    num_people: int,
    rng: np.random.Generator,
) -> list[Int[np.ndarray, "camera"]]:
    """The number of each person's keypoints in each camera of a frame; -1 where it was not seen."""
    left = weights.copy()
    return [_next_person(poses, rays, left, rng) for _ in range(num_people)]


def _next_person(
    poses: Float[np.ndarray, "camera 3 4"],
    rays: Float[np.ndarray, "camera person keypoint 2"],
    left: Float[np.ndarray, "camera person keypoint"],
    rng: np.random.Generator,
) -> Int[np.ndarray, "camera"]:
    """The person whom most cameras confirm; it is taken out of `left`."""
    cameras = len(left)
    nobody = np.full(cameras, -1)
    there = np.argwhere((left > 0.0).sum(-1) >= LEAST_POINTS)
    if len(np.unique(there[:, 0])) < 2:
        return nobody
    camera_of, person_of = there.T
    views = Rays(poses[camera_of], rays[camera_of, person_of], left[camera_of, person_of])
    pairs = all_pairs(camera_of.tolist())
    if len(pairs) > MOST_PAIRS:
        pairs = pairs[np.sort(rng.choice(len(pairs), MOST_PAIRS, replace=False))]
    points, both = points_of_pairs(views, pairs)
    close = np.clip(1.0 - distances(views, points) / SAME_PERSON, 0.0, None)
    support = (close * views.weights * both[:, None]).sum(-1)
    best_of_camera = np.zeros((len(pairs), cameras))
    for camera in np.unique(camera_of):
        best_of_camera[:, camera] = support[:, camera_of == camera].max(1)
    best = int(best_of_camera.sum(1).argmax())
    shares = support[best] / views.weights.sum(-1)
    for camera in np.unique(camera_of):
        of_camera = np.flatnonzero(camera_of == camera)
        view = of_camera[shares[of_camera].argmax()]
        if shares[view] >= LEAST_SHARE:
            nobody[camera] = person_of[view]
            left[camera, person_of[view]] = 0.0
    return nobody


def _followed(points: Float[np.ndarray, "frame person keypoint 3"]) -> Int[np.ndarray, "frame person"]:
    """The order of each frame in which people are nearest to where they were last seen."""
    frames, people = points.shape[:2]
    order = np.tile(np.arange(people), (frames, 1))
    if people == 1:
        return order
    last = points[0].copy()
    for frame in range(1, frames):
        order[frame] = _nearest(last, points[frame])
        now = points[frame, order[frame]]
        last = np.where(np.isfinite(now), now, last)
    return order


def _nearest(
    last: Float[np.ndarray, "person keypoint 3"], now: Float[np.ndarray, "person keypoint 3"]
) -> Int[np.ndarray, "person"]:
    gaps = np.linalg.norm(last[:, None] - now[None], axis=-1)
    counts = np.isfinite(gaps).sum(-1)
    costs = np.where(counts > 0, np.nansum(gaps, axis=-1) / np.maximum(counts, 1), 1e3)
    order = np.full(len(last), -1)
    for _ in range(len(last)):
        one, other = np.unravel_index(costs.argmin(), costs.shape)
        order[one] = other
        costs[one, :] = costs[:, other] = np.inf
    return order
