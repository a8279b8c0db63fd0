"""Opening recordings and actors, and making actors where none are given."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np

from sogjax.actor.make import MadeActor, make_actor, subjects_of
from sogjax.check.cameras import rig_geometry
from sogjax.check.scale import implausible_distance
from sogjax.errors import InputError
from sogjax.io.actor_file import load_body, named_body
from sogjax.io.recording import Recording, open_recording
from sogjax.io.recording_settings import read_recording_settings
from sogjax.model.body import Body
from sogjax.model.rotation import world_from_upright
from sogjax.run.build import color_space_and_radius, energy_terms
from sogjax.run.example_frames import check_actors, with_examples
from sogjax.run.keypoint_actor import keypoint_actor, with_rough_poses
from sogjax.run.terminal import progress, say
from sogjax.search.mirrored import means_of
from sogjax.settings.method import ColorConfig, EnergyConfig, ImagesConfig


def opened(path: str, cameras: Sequence[str] | None = None) -> Recording:
    """A recording with some or all of its cameras; its warnings are printed.

    Raises:
        InputError: the recording is invalid, or lacks one of the cameras.
    """
    recording = open_recording(Path(path))
    for warning in recording.warnings:
        say(f"warning: {warning}")
    return with_cameras(recording, cameras)


def with_cameras(recording: Recording, cameras: Sequence[str] | None) -> Recording:
    """A recording with some of its cameras; None: with all.

    Raises:
        InputError: none, one twice, or one that it does not have.
    """
    if cameras is None:
        return recording
    if isinstance(cameras, str):
        raise InputError(f"cameras={cameras}: must be a list of names, such as [{cameras!r}]")
    if not cameras or len(set(cameras)) < len(cameras):
        named = ", ".join(recording.rig.names)
        raise InputError(f"cameras=[{','.join(cameras)}]: name at least one camera, each once; there are {named}")
    unknown = [name for name in cameras if name not in recording.rig.names]
    if unknown:
        raise InputError(
            f"cameras={','.join(cameras)}: {recording.path} has no camera {', '.join(unknown)}; "
            f"it has {', '.join(recording.rig.names)}"
        )
    return replace(recording, rig=recording.rig.select(tuple(cameras)))


def body_named(name: str) -> Body:
    """A bundled body, or one from a file.

    Raises:
        InputError: there is neither.
    """
    path = Path(name)
    return load_body(path if path.is_file() else named_body(name))


def file_list(value: Any) -> list[Path]:
    """One file or several, as a config gives them."""
    values = value if isinstance(value, (list, tuple)) else [value]
    return [Path(str(item)) for item in values]


def _check_different(files: Any, bodies: Sequence[Body]) -> None:
    """Two of one size, shape and colours are one person twice, whatever they are called.

    Raises:
        InputError: there are such.
    """
    for k, body in enumerate(bodies):
        for other in bodies[:k]:
            alike = body.blob_colors.shape == other.blob_colors.shape and all(
                np.array_equal(one, two)
                for one, two in (
                    (body.blob_colors, other.blob_colors),
                    (body.blob_sigmas, other.blob_sigmas),
                    (body.skeleton.offsets, other.skeleton.offsets),
                )
            )
            if alike:
                raise InputError(f"actor={files}: two of these are the same actor; give one file for each person")


def actors_of(
    recording: Recording,
    files: Any,
    body: str,
    color: ColorConfig,
    images: ImagesConfig | None = None,
    actors: int | None = None,
) -> tuple[list[Body], list[MadeActor]]:
    """The actors of a recording, and what was found where they are made of its example poses or its videos.

    `actors` is how many are made of its videos, None one; files and example poses must be as many.

    Raises:
        InputError: an invalid actor file, two actors with one name, unsuitable example poses, or videos that none can
            be taken from.
    """
    if files is not None:
        bodies = [load_body(path) for path in file_list(files)]
        names = [body.name for body in bodies]
        _check_different(files, bodies)
        if len(set(names)) < len(names):
            raise InputError(
                f"actor={files}: two actors are named {max(names, key=names.count)!r}; give each its own `name`"
            )
        check_actors(recording, actors, len(bodies))
        check_scale(recording, bodies)
        return bodies, []
    check_scale(recording, [body_named(body)])
    space, _ = color_space_and_radius(color)
    images = images or ImagesConfig()
    bodies, made = _made_actors(
        str(recording.path), recording.rig.names, body, space, images.background, images.cache, actors
    )
    return list(bodies), list(made)


@cache
def _made_actors(
    path: str, cameras: tuple[str, ...], body: str, space: str, background: str, cells: str | None, actors: int | None
) -> tuple[tuple[Body, ...], tuple[MadeActor, ...]]:
    """The actors of a recording, made once per process: the members of a sweep share them."""
    start = body_named(body)
    recording = open_recording(Path(path))
    recording = replace(recording, rig=recording.rig.select(cameras))
    images = ImagesConfig(background=background, cache=cells)
    try:
        made = _of_examples(recording, start, space, images, actors)
        return tuple(actor.body for actor in made), made
    except InputError as error:
        return (keypoint_actor_or(error, recording, start, space, actors),), ()


def keypoint_actor_or(
    error: InputError, recording: Recording, start: Body, space: str, actors: int | None, symmetric: bool = True
) -> Body:
    """The actor of keypoints, where none can be made of pictures for a reason.

    Raises:
        InputError: the reason, where there are example poses, several actors, or no keypoints that tell.
    """
    if recording.example_poses or actors not in (None, 1):
        raise error
    actor = keypoint_actor(recording, start, space, symmetric)
    if actor is None:
        raise error
    say(f"the actor is made of the keypoints and of colours at the posed body, as its outlines cannot be had ({error})")
    return actor


def _of_examples(
    recording: Recording, start: Body, space: str, images: ImagesConfig, actors: int | None
) -> tuple[MadeActor, ...]:
    recording, learnt, best = with_examples(recording, images, actors)
    recording = with_rough_poses(recording, start)
    terms = energy_terms(EnergyConfig())
    made = []
    for subject in subjects_of(recording):
        label = "actor" if subject is None else f"actor {subject}"
        report = lambda stage, label=label: say(f"{label}: {stage}")
        made.append(make_actor(recording, start, subject, space, terms, report, progress, learnt=learnt, best=best))
    return tuple(made)


def check_scale(recording: Recording, bodies: Sequence[Body]) -> None:
    """Check that the cameras stand as far from what they look at as bodies of this size are filmed from.

    Raises:
        InputError: they do not; the calibration's unit of length is probably another.
    """
    settings = recording.path / "recording.yaml"
    problem = implausible_distance(
        rig_geometry(recording.rig, recording.up),
        read_recording_settings(settings).unit,
        max(_extent(body) for body in bodies),
    )
    if problem is not None:
        raise InputError(f"{recording.path}: {problem}")


def _extent(body: Body) -> float:
    """The largest side of a body in its rest pose, in metres."""
    means = means_of(body, np.asarray(body.poses["rest"])[None])[0]
    radii = np.asarray(body.blob_sigmas)[:, None]
    return float(((means + radii).max(axis=0) - (means - radii).min(axis=0)).max())


def upright(body: Body, recording: Recording) -> Body:
    """A body that stands upright in the recording's world."""
    return body.rotated(jnp.asarray(world_from_upright(recording.up), body.blob_sigmas.dtype))
