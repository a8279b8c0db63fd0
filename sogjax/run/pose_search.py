"""Searching the frames of a recording for the poses of its actors."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, UInt8

from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.io.video import read_frames
from sogjax.model.body import Body
from sogjax.run import build
from sogjax.scene.cells import padded_cells, stack_shape
from sogjax.search.found_pose import FoundPose, search_poses
from sogjax.search.mirrored import means_of, sides_apart
from sogjax.search.pose_confidence import Agreement, followed
from sogjax.search.pose_search import Optimum, PoseSearch, Report, unreported
from sogjax.search.seen_frame import SeenFrame
from sogjax.settings.run import TrackConfig

NUM_FOLLOWED, SECONDS = 6, 0.07
"""Frames through which hypotheses are followed, and the time between them."""
TRIES = (0.0, 0.4, 0.8, 1.6, 3.0, 6.0)
"""Seconds after the first frame at which a search is tried again."""
AGREEING = 0.4
"""Seconds to the frame in which a search that is not sure by itself is to find the same."""


@dataclass(frozen=True)
class Beginning:
    """A frame, and the poses that were found there."""

    frame: int
    poses: list[FoundPose]

    @property
    def sure(self) -> bool:
        """Whether all of them are."""
        return all(pose.sure for pose in self.poses)

    @property
    def confidence(self) -> float:
        """That of the least sure one."""
        return min(pose.confidence for pose in self.poses)


@dataclass(frozen=True)
class ClipSearch:
    """What searches of a recording's frames need; bodies stand upright in its world."""

    recording: Recording
    bodies: Sequence[Body]
    config: TrackConfig
    terms: Sequence[Term] = ()

    @cached_property
    def _grids(self):
        return build.cell_grids(self.recording, self.config.images.depth)

    @cached_property
    def _cameras(self):
        return build.device_cameras(self.recording)

    @cached_property
    def _reader(self):
        return build.image_reader(self.recording, self._grids, self.config, self.bodies)

    @cached_property
    def _searchers(self) -> list[PoseSearch]:
        terms = build.energy_terms(self.config.energy, self.terms)
        return [PoseSearch.of_body(body, terms, self.recording.up) for body in self.bodies]

    @property
    def has_background(self) -> bool:
        """Whether anything is known of the empty scene."""
        return self._reader.background is not None

    @cached_property
    def _searched(self) -> dict[int, list[FoundPose]]:
        """What was found, by frame."""
        return {}

    def beginning(self, frame: int, report: Report = unreported) -> Beginning:
        """The best poses in a frame, and how sure they are: by themselves, or since a search in another one agrees.

        `report` is called with the share of the work that is done, as if the second search were needed.

        Raises:
            InputError: no camera has the frame.
        """
        found = Beginning(frame, self.poses(frame, lambda share: report(0.5 * share)))
        other = self._agreeing_frame(frame)
        if found.sure or other is None or not all(pose.energy > 0.0 for pose in found.poses):
            return found
        agreements = self._agreements(
            found, Beginning(other, self.poses(other, lambda share: report(0.5 + 0.5 * share)))
        )
        judged = [pose.with_agreement(each) for pose, each in zip(found.poses, agreements, strict=True)]
        return Beginning(frame, judged)

    def _agreeing_frame(self, frame: int) -> int | None:
        """The frame some time later, or before, where the clip ends; None: the clip is too short."""
        step = max(round(AGREEING * self.recording.fps), 1)
        return next((other for other in (frame + step, frame - step) if 0 <= other < self.recording.num_frames), None)

    def _agreements(self, first: Beginning, second: Beginning) -> list[Agreement]:
        """Of each actor."""
        agreements = []
        followed_there = self.carried(first, second.frame)
        for body, a, b, there in zip(self.bodies, first.poses, second.poses, followed_there, strict=True):
            poses = np.stack([a.pose, there, b.pose]).astype(np.float32)
            before, after, found = means_of(body, poses)
            distance = lambda p, q: float(np.linalg.norm(p - q, axis=-1).mean())
            limbs = [-np.inf if pose.evidence is None else pose.evidence.worst_limb for pose in (a, b)]
            agreements.append(
                Agreement(
                    apart=distance(after, found),
                    moved=distance(before, after),
                    sides=float(sides_apart(body, poses).min()),
                    worst_limb=min(limbs),
                    num_actors=len(self.bodies),
                )
            )
        return agreements

    def poses(self, frame: int, report: Report = unreported) -> list[FoundPose]:
        """The best poses of all actors in a frame, counted from the recording's first, by what is seen there.

        Raises:
            InputError: no camera has the frame.
        """
        if frame not in self._searched:
            self._searched[frame] = self._search(frame, report)
        return self._searched[frame]

    def _search(self, frame: int, report: Report) -> list[FoundPose]:
        frames = self._followed_frames(frame)
        cells = dict(self._cells(sorted(frames)))
        if not cells[frame][1].any():
            shown = frame + self.recording.first_frame
            raise InputError(f"{self.recording.path}: no camera has frame {shown}; begin later (start=)")
        make = lambda searcher, k: self._seen(searcher, *cells[frames[k]])
        return search_poses(self.bodies, self._searchers, make, len(frames), report)

    def carried(self, beginning: Beginning, frame: int) -> list[Float[np.ndarray, "dof"]]:
        """The poses of a beginning, followed to another frame."""
        poses = [np.asarray(found.pose) for found in beginning.poses]
        if frame == beginning.frame:
            return poses
        cells = dict(self._cells(range(min(frame, beginning.frame), max(frame, beginning.frame) + 1)))
        step = 1 if frame > beginning.frame else -1
        ends = []
        for searcher, pose in zip(self._searchers, poses, strict=True):
            frames = (self._seen(searcher, *cells[k]) for k in range(beginning.frame, frame + step, step))
            ends.append(followed(searcher, [Optimum(pose, 0.0)], frames).poses[-1, 0])
        return ends

    def _followed_frames(self, frame: int) -> list[int]:
        """The frame and some after it; before it, where the clip ends."""
        step = max(round(SECONDS * self.recording.fps), 1)
        last = self.recording.num_frames - 1
        count = min(NUM_FOLLOWED, max(frame, last - frame) // step + 1)
        forward = frame + (count - 1) * step <= last
        return [frame + (k if forward else -k) * step for k in range(count)]

    def _seen(self, searcher: PoseSearch, cells: np.ndarray, present: np.ndarray) -> SeenFrame:
        return SeenFrame.from_cells(self._cameras, self._reader, cells, searcher.kinds, present.tolist())

    def _cells(self, frames: Sequence[int]) -> Iterator[tuple[int, tuple[UInt8[np.ndarray, "_ _ _ 3"], np.ndarray]]]:
        """The cells of some frames, in their order, and which cameras have a picture."""
        shape, grids, wanted = stack_shape(self._grids), self._grids, set(frames)
        nothing = np.zeros((*shape, 3), np.uint8)
        pictures = read_frames(self.recording, frames[0], frames[-1] + 1)
        for frame, images in enumerate(pictures, frames[0]):
            if frame in wanted:
                present = np.array([image is not None for image in images])
                parts = [
                    nothing if image is None else padded_cells(image, grid, shape)
                    for image, grid in zip(images, grids, strict=True)
                ]
                yield frame, (np.stack(parts), present)


def tried_frames(first: int, last: int, fps: float) -> list[int]:
    """The frames from `first` to before `last` that are searched until one is clear."""
    return sorted({min(first + round(seconds * fps), last - 1) for seconds in TRIES})
