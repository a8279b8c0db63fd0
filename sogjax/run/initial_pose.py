"""The pass that finds where tracking begins: sources of the initial pose, asked in turn."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Array, Float

from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.npz_file import finite_array, read_npz, save_npz, text_array
from sogjax.io.pose_description import PoseDescription, load_initial_poses
from sogjax.io.recording import Recording
from sogjax.model.body import Body, dof_slices
from sogjax.run.actors import Actors
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.clip_search import ClipSearch, SeenAtRest, best_guess
from sogjax.run.keypoint_initial_pose import keypoint_poses
from sogjax.run.recordings import body_named, upright
from sogjax.run.terminal import say
from sogjax.search.described_pose import check_described_pose, described_pose
from sogjax.search.found_pose import FoundPose
from sogjax.settings.run import TrackConfig

NAMES = ("auto",)
"""Values of the setting `initial_pose` that name no file, but what is asked instead of files and keypoints."""
FILE, FROM_FILE = "initial_pose.npz", "file"
ELSEWHERE = 1.0
"""Metres between a rough pose and what looks like the actor from which on it is doubted."""


@dataclass(frozen=True)
class InitialPose:
    """Where tracking begins."""

    frame: int
    """The recording's number; frames before it are tracked backwards."""
    pose: Float[np.ndarray, "dof"]
    """A rough pose of all actors in that frame."""
    source: str
    """Which of the sources found it."""
    confidence: Float[np.ndarray, "actor"] | None = None
    """How likely the trunk of each actor is right, 0 to 1, as the search says; None: it was not searched for."""

    @classmethod
    def of_actors(cls, frame: int, poses: Sequence[Float[np.ndarray | Array, "_dof"]], source: str) -> "InitialPose":
        """From the pose of each actor."""
        return cls(frame, np.concatenate([np.asarray(pose) for pose in poses]), source)

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder."""
        arrays = {"pose": self.pose, "frame": np.array(self.frame), "source": np.array(self.source)}
        save_npz(folder / FILE, arrays | ({} if self.confidence is None else {"confidence": self.confidence}))

    @classmethod
    def load(cls, folder: Path) -> "InitialPose | None":
        """What was kept, if it was."""
        path = folder / FILE
        if not path.is_file():
            return None
        arrays = read_npz(path)
        pose = np.asarray(finite_array(path, arrays, "pose", (None,)), arrays["pose"].dtype)
        frame = int(finite_array(path, arrays, "frame", ()))
        confidence = finite_array(path, arrays, "confidence", (None,)) if "confidence" in arrays else None
        return cls(frame, pose, str(text_array(path, arrays, "source", ())), confidence)


@dataclass(frozen=True)
class PoseRequest:
    """What an initial pose is asked for, and all that is known before tracking."""

    clip: Clip
    background: Background
    actors: Actors
    config: TrackConfig
    terms: Sequence[Term] = ()
    """Of the energy, beside those of the settings."""
    told: SeenAtRest | None = None
    """Is told by a search, before poses are searched for."""
    picture: Path | None = None
    """Where the best guess is drawn if none is sure; None: into the working folder, where it is refused."""

    @property
    def bodies(self) -> list[Body]:
        """The actors as they stand in the recording's world."""
        return [upright(actor, self.clip.recording) for actor in self.actors.bodies]


PoseSource = Callable[[PoseRequest], InitialPose | None]
"""Finds an initial pose, or None where it cannot tell."""


def find_initial_pose(request: PoseRequest, sources: Sequence[PoseSource]) -> InitialPose:
    """The pose of the first source that tells one.

    Raises:
        InputError: none does, or the source that was asked for cannot be used.
    """
    for source in sources:
        if (found := source(request)) is not None:
            return found
    raise InputError(
        f"{request.clip.recording.path}: no initial pose was found; write one into "
        f"{request.clip.recording.path / 'initial_pose.yaml'}"
    )


def from_file(request: PoseRequest) -> InitialPose | None:
    """The rough pose of the recording's `initial_pose.yaml`, or of the file that was asked for.

    Raises:
        InputError: the file is invalid.
    """
    recording, frame = request.clip.recording, request.clip.numbers[0]
    descriptions = described_poses(recording, request.bodies, request.config)
    if descriptions is None:
        return None
    if frame > 0:
        say(f"warning: the rough pose of {pose_file(recording, request.config)} is used for frame {frame}")
    pairs = zip(request.bodies, descriptions, strict=True)
    return InitialPose.of_actors(frame, [described_pose(body, each, recording.up) for body, each in pairs], FROM_FILE)


def from_example_frames(request: PoseRequest) -> InitialPose | None:
    """The frame of the videos that every actor was made of in which all fit best, if it is among those to track."""
    known = [each for each in request.actors.known_frames if each.frame in request.clip.numbers]
    if not known:
        if others := ", ".join(str(each.frame) for each in request.actors.known_frames):
            say(f"the frames in which the poses are known ({others}) are not among those to track")
        return None
    best = max(known, key=lambda each: each.agreement)
    whose = "whose pose is known" if len(request.actors.bodies) == 1 else "where all poses are known"
    say(f"tracking begins in frame {best.frame}, {whose}, and goes both ways")
    return InitialPose(best.frame, best.pose, "example frames")


def from_keypoints(request: PoseRequest) -> InitialPose | None:
    """The poses that keypoints beside the recording tell in the first frame, unless something else was asked for.

    Raises:
        InputError: none of the keypoint files can be used.
    """
    if request.config.initial_pose in NAMES:
        return None
    frame = request.clip.numbers[0]
    poses = keypoint_poses(request.clip, request.background, request.bodies, request.config, frame)
    return None if poses is None else InitialPose.of_actors(frame, poses, "keypoints")


def from_search(request: PoseRequest) -> InitialPose | None:
    """The poses of a search in the first frame in which they are sure; in the likeliest, if they are in none.

    Raises:
        InputError: the frames show nothing like an actor, or fewer people than actors.
    """
    search = ClipSearch(request.clip, request.background, request.bodies, request.config, request.terms, request.told)
    guess = best_guess(search, request.picture)
    if guess.frame != request.clip.numbers[0]:
        say(f"tracking begins in frame {guess.frame}, and goes both ways")
    found = InitialPose.of_actors(guess.frame, [pose.pose for pose in guess.poses], "search")
    return replace(found, confidence=np.array([pose.trunk for pose in guess.poses]))


SOURCES: tuple[PoseSource, ...] = (from_file, from_example_frames, from_keypoints, from_search)
"""In the order in which they are asked."""


def compile_sources(clip: Clip, background: Background, config: TrackConfig) -> None:
    """Compile a search beforehand, while actors are made; nothing where something else will tell where they begin."""
    examples = clip.recording.example_poses
    of_frames = not examples or any(each.frame is not None for each in examples)
    if of_frames or clip.keypoints is not None or pose_file(clip.recording, config) is not None:
        return
    body = upright(body_named(config.body), clip.recording)
    ClipSearch(clip, background, [body], config).compile_beforehand()


def pose_file(recording: Recording, config: TrackConfig) -> Path | None:
    """The file with rough poses; None: there is none, or something else was asked for.

    Raises:
        InputError: the requested file does not exist.
    """
    if config.initial_pose in NAMES:
        return None
    if config.initial_pose is None:
        return recording.initial_poses
    path = Path(config.initial_pose)
    if not path.is_file():
        raise InputError(
            f"initial_pose={config.initial_pose}: there is no such file; give one, or initial_pose={'|'.join(NAMES)}"
        )
    return path


def described_poses(recording: Recording, bodies: Sequence[Body], config: TrackConfig) -> list[PoseDescription] | None:
    """What the file says of the poses of bodies, upright in the recording's world; None: there is no file.

    Raises:
        InputError: the file is invalid.
    """
    path = pose_file(recording, config)
    if path is None:
        return None
    given = load_initial_poses(path, [body.name for body in bodies])
    for body in bodies:
        try:
            check_described_pose(body, given[body.name], recording.up)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
    return [given[body.name] for body in bodies]


def searched_poses(request: PoseRequest) -> list[FoundPose]:
    """The poses that fit the pictures of the first frame best, in the order of the actors, sure or not.

    Raises:
        InputError: the pictures show nothing in an actor's colours where the cameras look.
    """
    search = ClipSearch(request.clip, request.background, request.bodies, request.config, request.terms)
    return search.found_in(request.clip.numbers[0])


def say_who_is_elsewhere(request: PoseRequest, found: InitialPose) -> None:
    """Warn of actors whose pose, from a file, is where nothing looks like them."""
    search = ClipSearch(request.clip, request.background, request.bodies, request.config, request.terms)
    poses = [found.pose[part] for part in dof_slices(request.bodies)]
    for body, away in zip(request.bodies, search.away(found.frame, poses), strict=True):
        if away > ELSEWHERE:
            nearest = (
                "nothing in the pictures looks like it"
                if np.isinf(away)
                else f"the nearest place that does is {away:.1f} m away"
            )
            say(
                f"warning: {pose_file(request.clip.recording, request.config)} puts {body.name} where nothing looks "
                f"like it in frame {found.frame} ({nearest}); if the pose is another recording's or another actor's, "
                "correct it, or leave it out with initial_pose=auto"
            )
