"""A picture of the best guess of a first pose, for the person who has to say what it is.

The poses of the actors in the first frame of a track: from a file, or searched for where they are clear.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import cv2
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from sogjax.actor.make import MadeActor
from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.io.initial_pose import InitialPose, load_initial_poses
from sogjax.io.motion import motion_from_poses
from sogjax.io.recording import Recording
from sogjax.io.video import read_frames
from sogjax.model.body import Body
from sogjax.run.clip_keypoints import ClipKeypoints
from sogjax.run.keypoint_start import keypoint_starts
from sogjax.run.pose_search import Beginning, ClipSearch, tried_frames
from sogjax.run.terminal import alive, say
from sogjax.search.found_pose import FoundPose
from sogjax.search.rough_pose import check_rough_pose, rough_pose
from sogjax.settings.run import TrackConfig
from sogjax.view.overlay import overlay_frame

WIDTH = 1600
"""Pixels."""


def write_unsure_picture(
    recording: Recording, bodies: Sequence[Body], guess: Beginning, path: Path | None = None
) -> Path:
    """Draw a guess over the pictures of its frame; where it was written (by default the current folder)."""
    path = Path(f"{recording.name}_first_pose.png") if path is None else path
    frame = guess.frame + recording.first_frame
    motions = []
    for body, found in zip(bodies, guess.poses, strict=True):
        motion = motion_from_poses(body, np.asarray(found.pose)[None], recording.fps)
        motions.append(replace(motion, frame=np.array([frame])))
    images = next(iter(read_frames(recording, guess.frame, guess.frame + 1)))
    drawn = overlay_frame(images, recording.rig, motions, frame, width=WIDTH)
    with atomic_path(path) as temporary:
        temporary.write_bytes(cv2.imencode(".png", drawn)[1].tobytes())
    return path


AUTO = "auto"


def initial_pose_file(recording: Recording, config: TrackConfig) -> Path | None:
    """The file with rough poses; None: they are searched for.

    Raises:
        InputError: the requested file does not exist.
    """
    if config.initial_pose == AUTO:
        return None
    if config.initial_pose is None:
        return recording.initial_poses
    path = Path(config.initial_pose)
    if not path.is_file():
        raise InputError(f"initial_pose={config.initial_pose}: there is no such file; give one, or initial_pose=auto")
    return path


def known_opening(
    recording: Recording, made: Sequence[MadeActor], config: TrackConfig
) -> tuple[Float[Array, "dof"], int] | None:
    """A frame of the videos that every actor was made of, the one where all fit best, and their poses there.

    None where tracking begins otherwise: with a rough pose from a file, or with a search, since no such frame is among
    those to be tracked.
    """
    if not made or initial_pose_file(recording, config) is not None:
        return None
    last = recording.num_frames if config.stop is None else config.stop
    shown = {
        name: frame
        for name, frame in made[0].frames.items()
        if config.start <= frame < last and all(name in actor.frames for actor in made)
    }
    if not shown:
        return None
    best = max(shown, key=lambda name: min(actor.agreement(name) for actor in made))
    known = "whose pose is known" if len(made) == 1 else "where all poses are known"
    say(f"tracking begins in frame {shown[best] + recording.first_frame}, {known}, and goes both ways")
    return jnp.concatenate([actor.example_poses[best] for actor in made]), shown[best]


def first_poses(
    recording: Recording,
    bodies: Sequence[Body],
    config: TrackConfig,
    frame: int,
    terms: Sequence[Term] = (),
    last: int | None = None,
    keypoints: ClipKeypoints | None = None,
) -> list[Float[Array, "dof"]]:
    """The poses of bodies, upright in the recording's world, in a frame counted from the recording's first.

    Without a file, keypoints beside the recording give the poses; without these they are searched for. Where they are
    searched for and not clear in that frame, they are searched for in later ones (before `last`) and
    followed back. `keypoints` are those of the recording, if they were read already.

    Raises:
        InputError: the file is invalid, or the actors are not found in the pictures.
    """
    descriptions = rough_descriptions(recording, bodies, config)
    if descriptions is None and config.initial_pose is None:
        known = keypoint_starts(recording, bodies, config, frame, None if keypoints is None else keypoints.found)
        if known is not None:
            return known
    if descriptions is None:
        search = ClipSearch(recording, bodies, config, terms)
        beginning = clear_beginning(search, frame, recording.num_frames if last is None else last)
        return [jnp.asarray(pose) for pose in search.carried(beginning, frame)]
    if frame + recording.first_frame > 0:
        path = initial_pose_file(recording, config)
        say(f"warning: the rough pose of {path} is used for frame {frame + recording.first_frame}")
    return [rough_pose(body, each, recording.up) for body, each in zip(bodies, descriptions, strict=True)]


def rough_descriptions(recording: Recording, bodies: Sequence[Body], config: TrackConfig) -> list[InitialPose] | None:
    """What the file says of the poses of bodies, upright in the recording's world; None: they are searched for.

    Raises:
        InputError: the file is invalid.
    """
    path = initial_pose_file(recording, config)
    if path is None:
        return None
    given = load_initial_poses(path, [body.name for body in bodies])
    for body in bodies:
        try:
            check_rough_pose(body, given[body.name], recording.up)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
    return [given[body.name] for body in bodies]


def clear_beginning(search: ClipSearch, first: int, last: int, picture: Path | None = None) -> Beginning:
    """The first of some frames from `first` up to `last` in which the poses of all actors are sure.

    Raises:
        InputError: there is none; a picture of the best guess is written to `picture`, or else beside the program's
            other outputs.
    """
    recording = search.recording
    guesses: list[Beginning] = []
    for frame in tried_frames(first, last, recording.fps):
        with alive(f"searching for the first pose in frame {frame + recording.first_frame}") as work:
            guesses.append(search.beginning(frame, partial(setattr, work, "share")))
        for body, pose in zip(search.bodies, guesses[-1].poses, strict=True):
            say(
                f"pose of {body.name} in frame {frame + recording.first_frame}: "
                f"{'sure' if pose.sure else 'not sure'} ({100.0 * pose.confidence:.0f} %)"
            )
        if guesses[-1].sure:
            return guesses[-1]
    best = max(guesses, key=lambda guess: guess.confidence)
    frames = ", ".join(str(guess.frame + recording.first_frame) for guess in guesses)
    if all(pose.energy <= 0.0 for pose in best.poses):
        names = ", ".join(body.name for body in search.bodies)
        raise InputError(
            f"{recording.path}: nothing like {names} is seen in frame {frames}; write {_remedy(recording)}, "
            "or begin with another frame (start=)"
        )
    path = write_unsure_picture(recording, search.bodies, best, picture)
    raise InputError(
        f"{recording.path}: no pose is sure in frame {frames}: the best guess is drawn in {path}; if it is right, or "
        f"else as it should be, write {_remedy(recording)}{_background_remedy(search)}"
    )


def searched_poses(
    recording: Recording, bodies: Sequence[Body], config: TrackConfig, frame: int, terms: Sequence[Term] = ()
) -> list[FoundPose]:
    """The poses that fit the pictures of a frame best, in the order of the bodies, sure or not.

    Raises:
        InputError: the pictures show nothing in an actor's colours where the cameras look.
    """
    found = ClipSearch(recording, bodies, config, terms).beginning(frame).poses
    lost = [body.name for body, pose in zip(bodies, found, strict=True) if not pose.energy > 0.0]
    if lost:
        raise InputError(
            f"{recording.path}: nothing like {', '.join(lost)} is seen in frame {frame + recording.first_frame}; "
            f"write {_remedy(recording)}, or begin with another frame (start=)"
        )
    return found


def _remedy(recording: Recording) -> str:
    return f"the rough pose into {recording.path / 'initial_pose.yaml'}"


def _background_remedy(search: ClipSearch) -> str:
    return "" if search.has_background else "; pictures of the empty scene (background/) help most"
