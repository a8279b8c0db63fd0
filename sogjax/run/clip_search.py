"""Searching the frames of a clip for the poses of its actors, without any hint."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.image_file import write_image
from sogjax.io.motion import motion_from_poses
from sogjax.io.video import read_chosen
from sogjax.model.body import Body
from sogjax.quality.fitted import fitted_numbers
from sogjax.run import build
from sogjax.run.background import Background
from sogjax.run.clip import Clip, spread_frames
from sogjax.run.terminal import alive, say
from sogjax.search import found_pose
from sogjax.search.found_pose import FoundPose, agreements
from sogjax.search.joint_search import search_poses
from sogjax.search.placed_body import centred, centres_of
from sogjax.search.places import Place, likeness, places
from sogjax.search.pose_search import PoseSearch, Report, Told, compile_pose_search, unreported, untold
from sogjax.search.seen_frame import SeenFrame
from sogjax.settings.run import TrackConfig
from sogjax.tracking.frame import FrameInput
from sogjax.view.overlay import overlay_frame

NUM_FOLLOWED, SECONDS = 6, 0.07
"""Frames through which hypotheses are followed, and the time between them; in the last one, a search that is not sure
by itself is to find the same."""
MOST_TRIED = 2
"""Frames that are searched, each with the one that is to agree with it, before the likeliest is taken."""
NUM_GLANCED = 6
"""Frames spread over the clip, of which that is searched next in which the actors are seen best."""
NUM_PLACES = 12
"""Places that look most like an actor, of which one is to be near where a file says that he is."""
ROOM = 1.0
"""Metres between two actors from which on neither is in the other's way."""
LYING, SELDOM = 0.5, 0.5
"""Cosine of the angle between the vertical of the world and that of a body, below which it lies or is upside down; and
what its likelihood is multiplied by then. Of two who danced before four cameras one was found in a shadow on the floor,
86 % likely, and both where they stood in another frame, 54 %."""
NOTHING_LEFT = 0.1
"""An actor is not there if this part is left of what it explains, once the others are taken away. Of somebody who is
hidden by others half is left, of a woman half of whom had become background a fourth; of nobody 0.02 at most."""


SeenAtRest = Callable[[FrameInput, Float[np.ndarray, "dof"]], object]
"""Is told of the first frame that is searched, and of all bodies at rest, where something looks like them."""


@dataclass(frozen=True)
class Guess:
    """A frame, and the poses that were found there."""

    frame: int
    poses: list[FoundPose]

    @property
    def sure(self) -> bool:
        """Whether tracking can begin there: the trunks of all actors are sure, and who is who."""
        return all(pose.trunk_sure for pose in self.poses)

    @property
    def side_by_side(self) -> bool:
        """Whether each of several actors keeps what it explains beside the others: another frame tells no more."""
        least = fitted_numbers().pose_agreement.least_share
        return len(self.poses) > 1 and all(pose.energy > 0.0 and pose.share >= least for pose in self.poses)

    @property
    def confidence(self) -> float:
        """That of the least sure trunk."""
        return min(pose.trunk for pose in self.poses)

    @property
    def likelihood(self) -> float:
        """That of the least likely trunk: as the confidence, but less of who lies or is upside down."""
        return min(pose.trunk * (1.0 if pose.upright > LYING else SELDOM) for pose in self.poses)


@dataclass(frozen=True)
class ClipSearch:
    """A search of a clip's frames for bodies that stand upright in its world."""

    clip: Clip
    background: Background
    bodies: Sequence[Body]
    config: TrackConfig
    terms: Sequence[Term] = ()
    told: SeenAtRest | None = None
    """Is told once, before poses are searched for."""

    @cached_property
    def _cameras(self):
        return build.device_cameras(self.clip.recording)

    @cached_property
    def _reader(self):
        return build.image_reader(self.clip, self.background, self.config, self.bodies)

    @cached_property
    def _searchers(self) -> list[PoseSearch]:
        terms = build.energy_terms(self.config.energy, self.terms)
        return [PoseSearch.of_body(body, terms, self.clip.recording.up, len(self.bodies)) for body in self.bodies]

    @cached_property
    def _searched(self) -> dict[int, list[found_pose.Path]]:
        """What was found, by frame."""
        return {}

    def guess(self, frame: int, report: Report = unreported) -> Guess:
        """The best poses in a frame, and how sure they are: by themselves, or since a search in another one agrees.

        `report` is called with the share of the work that is done, as if the second search were needed.

        Raises:
            InputError: no camera has the frame.
        """
        return self.guesses(frame, report)[0]

    def guesses(self, frame: int, report: Report = unreported) -> list[Guess]:
        """The guess of a frame, and that of the frame whose search was to agree with it, if there was one.

        A frame that is not to be tracked is only looked at: tracking cannot begin there.

        Raises:
            InputError: no camera has the frame.
        """
        paths, other = self.paths(frame, lambda share: report(0.5 * share)), self._followed_frames(frame)[-1]
        second = lambda: None if other == frame else self.paths(other, lambda share: report(0.5 + 0.5 * share))
        first, *agreeing = agreed(self.bodies, (frame, other), paths, second)
        return [first, *(guess for guess in agreeing if guess.frame in self.clip.numbers)]

    def paths(self, frame: int, report: Report = unreported) -> list[found_pose.Path]:
        """The best poses of all actors in a frame and those that come next, by what is seen there.

        Raises:
            InputError: no camera has the frame.
        """
        if frame not in self._searched:
            self._searched[frame] = self._search(frame, report)
        return self._searched[frame]

    def _search(self, frame: int, report: Report) -> list[found_pose.Path]:
        numbers = self._followed_frames(frame)
        return self.paths_in([*self.clip.frames(numbers.start, numbers.stop, numbers.step)], report)

    def paths_in(self, frames: Sequence[FrameInput], report: Report = unreported) -> list[found_pose.Path]:
        """The best poses of all actors in the first of some frames and in the others, by what is seen there."""
        make = lambda searcher, k: self._seen(searcher, frames[k])
        return search_poses(self._searchers, make, len(frames), report, self._with_places(frames[0]))

    def _with_places(self, frame: FrameInput) -> Told:
        """What a search does with the places that it finds in a frame."""
        told = self.told
        return untold if told is None or self._searched else lambda found: told(frame, self._at_rest(found))

    def _at_rest(self, found: Sequence[Place]) -> Float[np.ndarray, "dof"]:
        """The bodies at rest in some places; several in the last one where these are fewer."""
        at = [found[min(k, len(found) - 1)].centre for k in range(len(self.bodies))]
        rest = [np.asarray(body.poses["rest"])[None] for body in self.bodies]
        return np.concatenate([centred(*each)[0] for each in zip(self.bodies, rest, at, strict=True)])

    def compile_beforehand(self) -> None:
        """Compile what a search needs, while other work goes on; of the bodies only structure and shapes count."""
        first = self.clip.numbers[0]
        seen = next(iter(self.clip.frames(first, first + 1)))
        compile_pose_search(self._searchers[0], self._seen(self._searchers[0], seen))

    def candidates(self) -> Iterator[int]:
        """The frames to search until one is clear: the first, then others in which the actors are seen best."""
        numbers = self.clip.numbers
        yield numbers[0]
        others = [frame for frame in spread_frames(numbers, NUM_GLANCED + 1) if frame not in self._searched]
        scores = {frame: self.clearness(frame) for frame in others}
        yield from sorted(others, key=lambda frame: (-scores[frame], frame))

    def clearness(self, frame: int) -> float:
        """At a glance: how much what is seen looks like the actors, and how far apart they are."""
        seen = next(iter(self.clip.frames(frame, frame + 1)))
        best = [places(self._seen(searcher, seen), searcher.up, 1) for searcher in self._searchers]
        if not all(best):
            return 0.0
        centres = np.stack([found[0].centre for found in best])
        between = np.linalg.norm(centres[:, None] - centres[None], axis=-1) + np.diag(np.full(len(best), np.inf))
        return min(found[0].score for found in best) * min(float(between.min()) / ROOM, 1.0)

    def away(self, frame: int, poses: Sequence[Float[np.ndarray, "_dof"]]) -> list[float]:
        """How far (metres) each body, in a pose, is from where something looks like it; infinite where nothing does."""
        frames = next(iter(self.clip.frames(frame, frame + 1)))
        return [
            self._away(searcher, frames, centres_of(body, pose[None])[0])
            for searcher, body, pose in zip(self._searchers, self.bodies, poses, strict=True)
        ]

    def _away(self, searcher: PoseSearch, frame: FrameInput, middle: Float[np.ndarray, "3"]) -> float:
        seen = self._seen(searcher, frame)
        if likeness(seen, middle) > 0.0:
            return 0.0
        off = (float(np.linalg.norm(place.centre - middle)) for place in places(seen, searcher.up, NUM_PLACES))
        return min(off, default=np.inf)

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


def agreed(
    bodies: Sequence[Body],
    frames: tuple[int, int],
    paths: Sequence[found_pose.Path],
    second: Callable[[], Sequence[found_pose.Path] | None],
) -> list[Guess]:
    """The guess of a frame and, unless it is sure by itself, that of a second search in the last frame of its paths.

    `second` searches there; None: it cannot.
    """
    found = Guess(frames[0], [path.found for path in paths])
    if found.sure or not all(pose.energy > 0.0 for pose in found.poses) or (later := second()) is None:
        return [found]
    other = Guess(frames[1], [path.found for path in later])
    parts = zip(bodies, paths, other.poses, strict=True)
    agreed = [agreements(body, path, there, len(bodies)) for body, path, there in parts]
    return [
        replace(guess, poses=[pose.with_agreements(*each) for pose, each in zip(guess.poses, agreed, strict=True)])
        for guess in (found, other)
    ]


def best_guess(search: ClipSearch, picture: Path | None = None) -> Guess:
    """The guess of the first of some frames in which tracking can begin; else the likeliest, which is said and drawn.

    `picture` is where it is drawn; None: it is not, unless nobody is there, and then in the working folder.

    Raises:
        InputError: the frames show nothing like an actor, or fewer people than actors.
    """
    guesses, names = list[Guess](), [body.name for body in search.bodies]
    for _, frame in zip(range(MOST_TRIED), search.candidates(), strict=False):
        with alive(f"searching for the initial pose in frame {frame}") as work:
            guesses += search.guesses(frame, partial(setattr, work, "share"))
        say_guess(names, max(guesses, key=lambda guess: guess.likelihood))
        if any(guess.sure or guess.side_by_side for guess in guesses):
            break
    best = likeliest(guesses)
    if best.sure:
        return best
    recording, frames = search.clip.recording, ", ".join(map(str, sorted({guess.frame for guess in guesses})))
    if (problem := nobody_there(guesses, names)) is not None:
        path = _write_picture(search, best, picture or Path(f"{recording.name}_first_pose.png"))
        raise InputError(
            f"{recording.path}: {problem} in frames {frames}; look at the best guess, drawn in {path}, and "
            f"leave out who is not there (actor=), begin with another frame (start=), or write {_remedy(search.clip)}"
        )
    look = "" if picture is None else f"; look at {_write_picture(search, best, picture)}"
    say(
        f"no pose is sure in frames {frames}: tracking begins with the likeliest (frame {best.frame}, "
        f"{100.0 * best.confidence:.0f} %){look}"
    )
    return best


def likeliest(guesses: Sequence[Guess]) -> Guess:
    """That whose least sure trunk is surest, of those in which everybody is seen, if any; few people are lying."""
    seen = [guess for guess in guesses if all(pose.energy > 0.0 for pose in guess.poses)]
    return max(seen or guesses, key=lambda guess: guess.likelihood)


def nobody_there(guesses: Sequence[Guess], names: Sequence[str]) -> str | None:
    """What is said of actors who are in none of the guesses; None: everybody is in some."""
    nothing = [name for k, name in enumerate(names) if all(guess.poses[k].energy <= 0.0 for guess in guesses)]
    if len(nothing) == len(names):
        return f"nothing like {' or '.join(names)} is seen"
    gone = [name for k, name in enumerate(names) if all(guess.poses[k].share < NOTHING_LEFT for guess in guesses)]
    missing = [name for name in names if name in nothing or name in gone]
    if not missing:
        return None
    others = [name for name in names if name not in missing]
    nobody = f"nobody is left for {' and '.join(missing)} beside {' and '.join(others)}"
    return nobody if len(others) == 1 else f"{nobody} (one of whom may be taken for another)"


def say_guess(names: Sequence[str], guess: Guess) -> None:
    """Tell how sure the poses of a guess are."""
    for name, pose in zip(names, guess.poses, strict=True):
        limbs = pose.unsure_limbs if pose.trunk_sure else []
        but = f" but for {', '.join(limbs)}" if limbs else ""
        say(
            f"pose of {name} in frame {guess.frame}: {'sure' if pose.trunk_sure else 'not sure'}{but} "
            f"({100.0 * pose.trunk:.0f} %)"
        )


def _write_picture(search: ClipSearch, guess: Guess, path: Path) -> Path:
    """Draw a guess over the pictures of its frame, for the person who has to say what the pose is."""
    recording, motions = search.clip.recording, []
    for body, found in zip(search.bodies, guess.poses, strict=True):
        motion = motion_from_poses(body, np.asarray(found.pose)[None], recording.fps)
        motions.append(replace(motion, frame=np.array([guess.frame])))
    _, images = next(read_chosen(recording, [guess.frame]))
    write_image(path, overlay_frame(images, recording.rig, motions, guess.frame, width=1600))
    return path


def _remedy(clip: Clip) -> str:
    return f"the rough pose into {clip.recording.path / 'initial_pose.yaml'}"
