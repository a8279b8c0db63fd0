"""The pass that learns where a detector puts its keypoints on the actors, from the clip's first frames."""

from dataclasses import dataclass, replace
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from sogjax.energy.keypoints import KeypointTerm, keypoint_term_among
from sogjax.io.npz_file import read_npz, save_npz
from sogjax.run.initial_pose import InitialPose
from sogjax.run.setup import Setup
from sogjax.run.terminal import progress, say
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.keypoint_prefit import estimated_offsets
from sogjax.tracking.tracker import Tracker

FRAMES, FEWEST = 48, 10
"""Frames of a clip that tell the offsets, at most and at least."""
LITTLE = 0.15
"""Share of the keypoints' weight that counts while the pictures are to tell where the body is."""
FILE = "keypoint_bias.npz"


@dataclass(frozen=True)
class KeypointBias:
    """How far the keypoints lie from the body's landmarks on average, which is not to pull."""

    offsets: Float[np.ndarray, "actor keypoint 3"] | None
    """Metres, in the landmarks' joint frames; None: nothing is known, or there are no keypoints."""

    def in_setup(self, setup: Setup) -> Setup:
        """The setup whose tracker knows it."""
        if self.offsets is None:
            return setup
        term = keypoint_term_among(setup.tracker.terms)
        assert term is not None
        known = eqx.tree_at(lambda t: t.offsets, term, jnp.asarray(self.offsets))
        return replace(setup, tracker=_with_term(setup.tracker, known))

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder."""
        save_npz(folder / FILE, {} if self.offsets is None else {"offsets": self.offsets})

    @classmethod
    def load(cls, folder: Path) -> "KeypointBias | None":
        """What was kept, if it was."""
        return cls(read_npz(folder / FILE).get("offsets")) if (folder / FILE).is_file() else None


def estimate_keypoint_bias(setup: Setup, start: InitialPose) -> KeypointBias:
    """The bias that the first frames tell, which are tracked with little weight on the keypoints.

    Raises:
        InputError: a video cannot be read, or a picture has too many image blobs.
    """
    clip, term = setup.clip, keypoint_term_among(setup.tracker.terms)
    numbers = clip.numbers[clip.numbers.index(start.frame) :][:FRAMES]
    if clip.keypoints is None or term is None or len(numbers) < FEWEST or len(clip.grids) < 2:
        return KeypointBias(None)
    lightly = _with_term(setup.tracker, eqx.tree_at(lambda t: t.weight, term, LITTLE * term.weight))
    frames = clip.frames(numbers.start, numbers.stop, numbers.step)
    shown = progress(frames, len(numbers), "tracking, to learn the keypoints' places")
    poses = np.stack([np.asarray(done.result.pose) for done in track(lightly, jnp.asarray(start.pose), shown)])
    return bias_of_poses(setup, np.asarray(numbers), poses)


def bias_of_poses(
    setup: Setup, frames: Int[np.ndarray, "frame"], poses: Float[np.ndarray, "frame dof"]
) -> KeypointBias:
    """The bias that frames with known poses tell, which is said."""
    tracker, term = setup.tracker, keypoint_term_among(setup.tracker.terms)
    if setup.clip.keypoints is None or term is None:
        return KeypointBias(None)
    seen = jax.tree.map(jnp.asarray, setup.clip.keypoints.of_frames(frames))
    known = jnp.asarray(poses, tracker.normalizers.dtype)
    offsets = np.asarray(
        estimated_offsets(term, tracker.body, tracker.cameras, tracker.normalizers, known, seen), np.float32
    )
    lengths = 1e3 * np.linalg.norm(offsets.astype(float), axis=-1)
    told = lengths[lengths > 0.0]
    if len(told):
        say(f"keypoints lie {told.mean():.0f} mm from the landmarks on average, at most {told.max():.0f} mm")
    return KeypointBias(offsets)


def _with_term(tracker: Tracker, term: KeypointTerm) -> Tracker:
    """The tracker with another term of the keypoints."""
    terms = tuple(term if isinstance(each, KeypointTerm) else each for each in tracker.terms)
    return eqx.tree_at(lambda t: t.terms, tracker, terms)
