"""The initial poses from keypoints that another program left beside a recording: nothing has to be searched."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.frame_energy import still_energy
from sogjax.energy.similarity import similarity_among
from sogjax.io.keypoints.load import Keypoints, load_keypoints
from sogjax.model.body import Body, concatenate
from sogjax.model.program import compiled
from sogjax.run import build
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.sampled_masks import masks_of_samples
from sogjax.run.terminal import say
from sogjax.search.described_pose import MIN_LANDMARKS
from sogjax.search.keypoint_people import triangulated_people
from sogjax.search.keypoint_pose import KeypointPose, pose_of_keypoints
from sogjax.search.seen_people import LEAST_SEEN, seen_share
from sogjax.settings.run import TrackConfig
from sogjax.tracking.capacity import first_capacities
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput, TrackState, on_device
from sogjax.tracking.tracker import Tracker

LEAST_ON = 0.7
"""Share of the points that the body's landmarks must be on."""
LEAST_POINTS = 10
"""Points that a pose must be fitted to."""
OTHERS = 2
"""People who are no actors, of whom it is tried whether they are."""
MOST_ACTORS = 4
"""Actors of whom it is tried who is who."""
CAMERAS = 3
"""Fewer do not tell whose keypoints of one camera are whose of another."""
CLEARLY = 1.05
"""By which factor the pictures must be more similar to be sure who is who."""


def keypoint_poses(
    clip: Clip, background: Background, bodies: Sequence[Body], config: TrackConfig, frame: int
) -> list[Float[Array, "dof"]] | None:
    """The poses of bodies, upright in the recording's world, in a frame.

    Who of several is who, the colours in the pictures tell. None where the recording has no keypoints, they give no
    poses that most of them agree with, or it is not clear who is who.

    Raises:
        InputError: none of the keypoint files can be used, or the frame cannot be read.
    """
    recording = clip.recording
    keypoints = _keypoints_of(clip, frame)
    if keypoints is None or len(recording.rig) < 2:
        return None
    if len(bodies) > MOST_ACTORS or (len(bodies) > 1 and len(recording.rig) < CAMERAS):
        return None
    people = _seen_people(clip, background, keypoints, frame, len(bodies))
    # Of each body in the place of each person.
    found = [[pose_of_keypoints(body, recording.up, keypoints.scheme, person) for person in people] for body in bodies]
    order = _who_is_who(clip, background, bodies, config, frame, found)
    if order is None:
        return None
    poses = [found[k][person] for k, person in enumerate(order)]
    if not all(_good(body, pose, frame) for body, pose in zip(bodies, poses, strict=True)):
        return None
    return [jnp.asarray(p.pose, b.poses["rest"].dtype) for b, p in zip(bodies, poses, strict=True) if p is not None]


def _seen_people(
    clip: Clip, background: Background, keypoints: Keypoints, frame: int, wanted: int
) -> list[Float[np.ndarray, "keypoint 3"]]:
    """The people of the keypoints of a frame, the surest first; with a background, those who stand where it is hidden.

    A few more than the actors are looked at: the surest may be bystanders, or nobody.
    """
    recording = clip.recording
    most = wanted + OTHERS if background.cameras is not None else wanted
    points = np.asarray(triangulated_people(keypoints, recording.rig, most).points[0], float)
    people = [person for person in points if np.isfinite(person).all(-1).sum() >= MIN_LANDMARKS]
    if background.cameras is None:
        return people
    seen = masks_of_samples(clip, background.cameras, (frame,))
    if not seen.frames:
        return people[:wanted]
    masks = {k: mask | seen.unknown[k] for k, mask in seen.masks[0].items()}
    shares = [seen_share(person, seen.cameras, masks) for person in people]
    for person, share in zip(people, shares, strict=True):
        if share < LEAST_SEEN:
            where = ", ".join(f"{x:.1f}" for x in np.nanmedian(person, axis=0))
            say(
                f"a person of the keypoints at ({where}) m is where hardly anything is seen in frame {frame} "
                f"({share:.0%} of the keypoints are on what is not the background), and is left out"
            )
    return [person for person, share in zip(people, shares, strict=True) if not share < LEAST_SEEN]


def _keypoints_of(clip: Clip, frame: int) -> Keypoints | None:
    """The keypoints of a frame; None: there are no files."""
    if clip.keypoints is not None:
        row = frame - clip.keypoints.first
        return clip.keypoints.found.between(row, row + 1)
    keypoints = load_keypoints(replace(clip.recording, first_frame=frame, num_frames=1))
    for warning in () if keypoints is None else keypoints.warnings:
        say(f"warning: {warning}")
    return keypoints


def _good(body: Body, found: KeypointPose | None, shown: int) -> bool:
    """Whether a pose agrees with most of its keypoints, which is said."""
    if found is None:
        return False
    good = found.on >= LEAST_ON and found.num_points >= LEAST_POINTS
    what = f"{found.num_points} keypoints, {100.0 * found.on:.0f} % of them on the body"
    say(f"pose of {body.name} in frame {shown} from {what}{'' if good else ': not sure, so it is searched for'}")
    return good


def _who_is_who(
    clip: Clip,
    background: Background,
    bodies: Sequence[Body],
    config: TrackConfig,
    frame: int,
    found: list[list[KeypointPose | None]],
) -> tuple[int, ...] | None:
    """The person that each body is, by how similar the pictures are; None where that is not clear, or too few are."""
    people = [k for k in range(len(found[0])) if all(of_body[k] is not None for of_body in found)]
    if len(people) < len(bodies):
        return None
    if len(bodies) == len(people) == 1:
        return (people[0],)
    orders = [*permutations(people, len(bodies))]
    tracker = build.tracker(clip, background, concatenate(list(bodies)), config)
    known = on_device(next(clip.frames(frame, frame + 1)))
    poses = [np.concatenate([_pose(found[k][person]) for k, person in enumerate(order)]) for order in orders]
    states = [TrackState.from_pose(jnp.asarray(pose, tracker.normalizers.dtype)) for pose in poses]
    capacities = first_capacities(tracker, states[0], known)
    values = np.array([float(_similarity(tracker, state, known, capacities)) for state in states])
    best, second = np.sort(values)[::-1][:2]
    if not best > CLEARLY * max(second, 0.0):
        say(f"who is who in frame {frame} is not clear, so poses are searched for")
        return None
    return orders[int(values.argmax())]


def _pose(found: KeypointPose | None) -> Float[np.ndarray, "dof"]:
    assert found is not None
    return found.pose


@compiled
def _similarity(
    tracker: Tracker,
    state: TrackState,
    frame: FrameInput,
    capacities: Capacities,
) -> Float[Array, ""]:
    views, _, _ = tracker.views(frame, state, capacities)
    return still_energy(tracker.body, state.previous, views, (similarity_among(tracker.terms),))
