"""What tracking a recording needs, made before it begins: the tracker, the frames and the first pose."""

from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float

from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.model.body import Body, concatenate
from sogjax.run import build
from sogjax.run.clip_keypoints import ClipKeypoints, clip_keypoints, keypoint_terms, with_keypoints
from sogjax.run.clock import FIRST_POSE, stage
from sogjax.run.first_pose import first_poses, rough_descriptions
from sogjax.run.kept_run import KeptRun
from sogjax.run.recordings import upright
from sogjax.scene.cells import CellGrid, stack_shape
from sogjax.settings.run import TrackConfig
from sogjax.tracking.capacity import compile_counts
from sogjax.tracking.frame import FrameInput
from sogjax.tracking.tracker import Tracker


@dataclass(frozen=True)
class Job:
    """Everything needed before tracking begins."""

    recording: Recording
    bodies: list[Body]
    """The actors, upright in the recording's world."""
    frames: tuple[int, int]
    """First and one after the last, counted from the recording's first."""
    grids: tuple[CellGrid, ...]
    tracker: Tracker
    start: Float[Array, "dof"]
    """The rough pose of the frame where tracking begins."""
    begin: int = 0
    """That frame, counted from the recording's first; those before it are tracked backwards."""
    keypoints: ClipKeypoints | None = None
    """What detectors saw; None: there are no files, or they do not count."""

    @property
    def num_before(self) -> int:
        """Frames that are tracked backwards."""
        return max(self.begin - self.frames[0], 0)

    @classmethod
    def from_config(
        cls,
        recording: Recording,
        bodies: list[Body],
        config: TrackConfig,
        kept: KeptRun | None = None,
        terms: Sequence[Term] = (),
        start: Float[Array, "dof"] | None = None,
    ) -> "Job":
        """The job of tracking actors (in their own upright frames), from the first pose that was kept, if any.

        `terms` are added to those of the settings; a first pose that is given as `start` is neither read nor searched.
        """
        bodies = [upright(body, recording) for body in bodies]
        frames = frame_range(recording, config)
        grids = build.cell_grids(recording, config.images.depth)
        keypoints = clip_keypoints(recording, config)
        if start is None:
            rough_descriptions(recording, bodies, config)  # what is wrong there is said before anything is learnt
        with ThreadPoolExecutor(1) as beside:  # both compile for seconds
            building = beside.submit(_tracker, recording, bodies, grids, config, terms, keypoints)
            begin = frames[0]
            if start is None and kept is not None and (opening := kept.start()) is not None:
                start, begin = opening
            if start is None:
                with stage(FIRST_POSE):
                    poses = first_poses(recording, bodies, config, begin, terms, keypoints=keypoints)
                start = jnp.concatenate(poses)
                if kept is not None:
                    kept.keep_start(start, begin)
            tracker = building.result()
        return cls(recording, bodies, frames, grids, tracker, start, begin, keypoints)

    def with_keypoints(self, frames: Iterable[FrameInput], numbers: Iterable[int]) -> Iterable[FrameInput]:
        """Frames with what detectors saw in them; `numbers` counts them from the recording's first."""
        return with_keypoints(self.keypoints, frames, numbers)


def _tracker(
    recording: Recording,
    bodies: list[Body],
    grids: tuple[CellGrid, ...],
    config: TrackConfig,
    terms: Sequence[Term],
    keypoints: ClipKeypoints | None,
) -> Tracker:
    body = concatenate(bodies)
    terms = (*terms, *keypoint_terms(keypoints, body, config))
    tracker = build.tracker(recording, body, grids, config, terms)
    compile_counts(tracker, (len(grids), *stack_shape(grids), 3))
    return tracker


def frame_range(recording: Recording, config: TrackConfig) -> tuple[int, int]:
    """First frame to track and the one after the last, counted from the recording's first.

    Raises:
        InputError: there is no frame between them.
    """
    last = recording.num_frames if config.stop is None else config.stop
    if not 0 <= config.start < last <= recording.num_frames:
        raise InputError(
            f"start={config.start} stop={'null' if config.stop is None else config.stop}: {recording.path} has the "
            f"frames 0 to {recording.num_frames - 1}; choose 0 <= start < stop <= {recording.num_frames}"
        )
    return config.start, last
