"""Searching the frames of a clip for the poses of its actors, without any hint."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.image_file import write_image
from sogjax.io.motion import motion_from_poses
from sogjax.io.video import read_frames
from sogjax.model.body import Body
from sogjax.run import build
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.terminal import alive, say
from sogjax.search.found_pose import FoundPose, followed, search_poses
from sogjax.search.mirrored import sides_apart
from sogjax.search.placed_body import means_of
from sogjax.search.pose_confidence import Agreement
from sogjax.search.pose_search import Optimum, PoseSearch, Report, unreported
from sogjax.search.seen_frame import SeenFrame
from sogjax.settings.run import TrackConfig
from sogjax.tracking.frame import FrameInput
from sogjax.view.overlay import overlay_frame

NUM_FOLLOWED, SECONDS = 6, 0.07
"""Frames through which hypotheses are followed, and the time between them."""
TRIES = (0.0, 0.4, 0.8, 1.6, 3.0, 6.0)
"""Seconds after the first frame at which a search is tried again."""
AGREEING = 0.4
"""Seconds to the frame in which a search that is not sure by itself is to find the same."""


@dataclass(frozen=True)
class Guess:
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
    """A search of a clip's frames for bodies that stand upright in its world."""

    clip: Clip
    background: Background
    bodies: Sequence[Body]
    config: TrackConfig
    terms: Sequence[Term] = ()

    @cached_property
    def _cameras(self):
        return build.device_cameras(self.clip.recording)

    @cached_property
    def _reader(self):
        return build.image_reader(self.clip, self.background, self.config, self.bodies)

    @cached_property
    def _searchers(self) -> list[PoseSearch]:
        terms = build.energy_terms(self.config.energy, self.terms)
        return [PoseSearch.of_body(body, terms, self.clip.recording.up) for body in self.bodies]

    @cached_property
    def _searched(self) -> dict[int, list[FoundPose]]:
        """What was found, by frame."""
        return {}

    def guess(self, frame: int, report: Report = unreported) -> Guess:
        """The best poses in a frame, and how sure they are: by themselves, or since a search in another one agrees.

        `report` is called with the share of the work that is done, as if the second search were needed.

        Raises:
            InputError: no camera has the frame.
        """
        found = Guess(frame, self.poses(frame, lambda share: report(0.5 * share)))
        other = self._agreeing_frame(frame)
        if found.sure or other is None or not all(pose.energy > 0.0 for pose in found.poses):
            return found
        agreements = self._agreements(found, Guess(other, self.poses(other, lambda share: report(0.5 + 0.5 * share))))
        judged = [pose.with_agreement(each) for pose, each in zip(found.poses, agreements, strict=True)]
        return Guess(frame, judged)

    def _agreeing_frame(self, frame: int) -> int | None:
        """The frame some time later, or before, where the clip ends; None: the clip is too short."""
        step = max(round(AGREEING * self.clip.recording.fps), 1)
        return next((other for other in (frame + step, frame - step) if other in self.clip.recording.frames), None)

    def _agreements(self, first: Guess, second: Guess) -> list[Agreement]:
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
        """The best poses of all actors in a frame, by what is seen there.

        Raises:
            InputError: no camera has the frame.
        """
        if frame not in self._searched:
            self._searched[frame] = self._search(frame, report)
        return self._searched[frame]

    def _search(self, frame: int, report: Report) -> list[FoundPose]:
        numbers = self._followed_frames(frame)
        frames = [*self.clip.frames(numbers.start, numbers.stop, numbers.step)]
        make = lambda searcher, k: self._seen(searcher, frames[k])
        return search_poses(self.bodies, self._searchers, make, len(frames), report)

    def carried(self, guess: Guess, frame: int) -> list[Float[np.ndarray, "dof"]]:
        """The poses of a guess, followed to another frame."""
        poses = [np.asarray(found.pose) for found in guess.poses]
        if frame == guess.frame:
            return poses
        step = 1 if frame > guess.frame else -1
        frames = [*self.clip.frames(guess.frame, frame + step, step)]
        ends = []
        for searcher, pose in zip(self._searchers, poses, strict=True):
            seen = (self._seen(searcher, each) for each in frames)
            ends.append(followed(searcher, [Optimum(pose, 0.0)], seen).poses[-1, 0])
        return ends

    def found_in(self, frame: int) -> list[FoundPose]:
        """The best poses in a frame, sure or not.

        Raises:
            InputError: the pictures show nothing in an actor's colours.
        """
        found = self.guess(frame).poses
        lost = [body.name for body, pose in zip(self.bodies, found, strict=True) if not pose.energy > 0.0]
        if lost:
            raise InputError(
                f"{self.clip.recording.path}: nothing like {', '.join(lost)} is seen in frame {frame}; "
                f"write {_remedy(self.clip)}, or begin with another frame (start=)"
            )
        return found

    def _followed_frames(self, frame: int) -> range:
        """The frame and some after it; before it, where the clip ends."""
        known = self.clip.recording.frames
        step = max(round(SECONDS * self.clip.recording.fps), 1)
        count = min(NUM_FOLLOWED, max(frame - known[0], known[-1] - frame) // step + 1)
        step = step if frame + (count - 1) * step <= known[-1] else -step
        return range(frame, frame + count * step, step)

    def _seen(self, searcher: PoseSearch, frame: FrameInput) -> SeenFrame:
        present = np.ones(len(frame.cells), bool) if frame.present is None else np.asarray(frame.present)
        return SeenFrame.from_cells(
            self._cameras, self._reader, np.asarray(frame.cells), searcher.clusters, present.tolist()
        )


def tried_frames(numbers: range, fps: float) -> list[int]:
    """The frames that are searched until one is clear; `fps` is that of the range."""
    return [numbers[row] for row in sorted({min(round(seconds * fps), len(numbers) - 1) for seconds in TRIES})]


def clear_guess(search: ClipSearch, picture: Path | None = None) -> Guess:
    """The guess of the first of some frames of the clip in which the poses of all actors are sure.

    Raises:
        InputError: there is none; a picture of the best guess is drawn, into `picture`, or else the working folder.
    """
    recording = search.clip.recording
    guesses: list[Guess] = []
    for frame in tried_frames(search.clip.numbers, search.clip.fps):
        with alive(f"searching for the initial pose in frame {frame}") as work:
            guesses.append(search.guess(frame, partial(setattr, work, "share")))
        for body, pose in zip(search.bodies, guesses[-1].poses, strict=True):
            say(
                f"pose of {body.name} in frame {frame}: {'sure' if pose.sure else 'not sure'} "
                f"({100.0 * pose.confidence:.0f} %)"
            )
        if guesses[-1].sure:
            return guesses[-1]
    best = max(guesses, key=lambda guess: guess.confidence)
    frames = ", ".join(str(guess.frame) for guess in guesses)
    if all(pose.energy <= 0.0 for pose in best.poses):
        names = ", ".join(body.name for body in search.bodies)
        raise InputError(
            f"{recording.path}: nothing like {names} is seen in frame {frames}; write {_remedy(search.clip)}, "
            "or begin with another frame (start=)"
        )
    path = _write_picture(search, best, picture or Path(f"{recording.name}_first_pose.png"))
    helpful = "" if search.background.cameras else "; pictures of the empty scene (background/) help most"
    raise InputError(
        f"{recording.path}: no pose is sure in frame {frames}: the best guess is drawn in {path}; if it is right, or "
        f"else as it should be, write {_remedy(search.clip)}{helpful}"
    )


def _write_picture(search: ClipSearch, guess: Guess, path: Path) -> Path:
    """Draw a guess over the pictures of its frame, for the person who has to say what the pose is."""
    recording, motions = search.clip.recording, []
    for body, found in zip(search.bodies, guess.poses, strict=True):
        motion = motion_from_poses(body, np.asarray(found.pose)[None], recording.fps)
        motions.append(replace(motion, frame=np.array([guess.frame])))
    images = next(iter(read_frames(recording, guess.frame, guess.frame + 1)))
    write_image(path, overlay_frame(images, recording.rig, motions, guess.frame, width=1600))
    return path


def _remedy(clip: Clip) -> str:
    return f"the rough pose into {clip.recording.path / 'initial_pose.yaml'}"
