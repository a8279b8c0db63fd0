"""The keypoints of a clip as its frames are tracked with them."""

from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Int

from sogjax.energy.keypoint_views import SeenKeypoints
from sogjax.energy.keypoints import KeypointTerm
from sogjax.io.keypoints.load import Keypoints, load_keypoints
from sogjax.io.keypoints.scheme import KeypointScheme
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.model.limbs import joint_limbs
from sogjax.run.terminal import say
from sogjax.search.triangulation import undistorted
from sogjax.settings.run import TrackConfig


@dataclass(frozen=True)
class ClipKeypoints:
    """What detectors saw in all frames of a recording."""

    found: Keypoints
    seen: SeenKeypoints
    """Keypoints by frame of the recording and camera."""
    first: int
    """The recording's number of its first frame."""

    @classmethod
    def of_recording(cls, recording: Recording) -> "ClipKeypoints | None":
        """The keypoints beside a recording; None where it has none. Warnings are printed.

        Raises:
            InputError: none of the keypoint files can be used.
        """
        found = load_keypoints(recording)
        if found is None:
            return None
        for warning in found.warnings:
            say(f"warning: {warning}")
        cameras = len(found.cameras)
        straight = undistorted(recording.rig, found.pixels.reshape(cameras, -1, 2)).reshape(found.pixels.shape)
        by_frame = lambda values: np.ascontiguousarray(np.moveaxis(values, 1, 0), np.float32)
        seen = SeenKeypoints(by_frame(straight), by_frame(found.confidence))
        return cls(found, seen, recording.first_frame)

    def of_frame(self, number: int) -> SeenKeypoints:
        """What was seen in a frame, by camera."""
        row = number - self.first
        return SeenKeypoints(self.seen.pixels[row], self.seen.confidence[row])

    def of_frames(self, numbers: Int[np.ndarray, "frame"]) -> SeenKeypoints:
        """What was seen in several frames, by frame and camera."""
        return SeenKeypoints(self.seen.pixels[numbers - self.first], self.seen.confidence[numbers - self.first])


def clip_keypoints(recording: Recording, config: TrackConfig) -> ClipKeypoints | None:
    """The keypoints that count in tracking; None: there are none, or they have no weight.

    Raises:
        InputError: none of the keypoint files can be used.
    """
    return ClipKeypoints.of_recording(recording) if config.energy.keypoint_weight > 0.0 else None


def keypoint_terms(keypoints: ClipKeypoints | None, body: Body, config: TrackConfig) -> tuple[KeypointTerm, ...]:
    """The term of the energy that they are; none without keypoints."""
    if keypoints is None:
        return ()
    return (keypoint_pull(keypoints.found.scheme, body, config.energy.keypoint_weight),)


def keypoint_pull(scheme: KeypointScheme, body: Body, weight: float) -> KeypointTerm:
    """The pull of keypoints of a scheme on the landmarks of a body, or of several that are one."""
    marks = [scheme.on(names) for names in _landmarks_by_actor(body)]
    return KeypointTerm(
        weight,
        landmarks=tuple(tuple(of_actor.tolist()) for of_actor in marks),
        mirrored=tuple(scheme.mirrored.tolist()),
        groups=_groups(scheme, body, marks[0].tolist()),
        offsets=jnp.zeros((len(marks), len(scheme.keypoints), 3), body.landmarks.offsets.dtype),
    )


def _landmarks_by_actor(body: Body) -> list[list[str]]:
    """The names of all landmarks as each actor's own scheme has them, empty for those of others."""
    trees, names = body.skeleton.trees, body.landmarks.names
    if max(trees) == 0:
        return [[*names]]
    actors = [trees[joint] for joint in body.landmarks.joints]
    own = lambda name, actor, one: name.partition("/")[2] if actor == one else ""
    return [[own(name, actor, one) for name, actor in zip(names, actors, strict=True)] for one in range(max(trees) + 1)]


def _groups(scheme: KeypointScheme, body: Body, marks: list[int]) -> tuple[int, ...]:
    """Those on a limb and on its counterpart are a group; all others that have sides, such as eyes, are one more."""
    limbs = joint_limbs(body.skeleton)
    limb_of = [int(limbs[body.landmarks.joints[mark]]) if mark >= 0 else -1 for mark in marks]
    pairs = [(min(limb_of[k], limb_of[other]), k != other) for k, other in enumerate(scheme.mirrored.tolist())]
    numbers = {limb: number for number, limb in enumerate(sorted({limb for limb, sided in pairs if sided}))}
    return tuple(numbers[limb] if sided else -1 for limb, sided in pairs)
