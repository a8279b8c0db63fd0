"""Actors: bodies fitted to one subject each, from files or from example poses."""

from pathlib import Path
from typing import Any

from sogjax.actor.make import MadeActor
from sogjax.errors import InputError
from sogjax.io.actor_file import save_body
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.actors import ActorRequest, actors_of_pictures, make_actors
from sogjax.run.recordings import body_named, with_cameras
from sogjax.settings.compose import composed_config
from sogjax.settings.run import ActorConfig

Actor = Body
"""A body that was fitted to a subject, in its own upright frame."""


def load_actor(name: str | Path) -> Body:
    """The actor of a file, in its own upright frame: x forward, y to its left, z up; metres.

    Args:
        name: an actor or body file (YAML), or a body that comes with the program: `human` or `dog`.

    Raises:
        InputError: no such file or body, or something in the file is wrong; the message names the key and its value.
    """
    return body_named(str(name))


def save_actor(path: str | Path, actor: Body) -> None:
    """Write an actor as a text file (YAML) that can be read and edited; the file appears only when it is whole.

    Raises:
        InputError: the file cannot be written.
    """
    save_body(Path(path), actor)


def make_actor(recording: Recording, subject: str | None = None, **settings: Any) -> Body:
    """The actor that a recording's example poses show (Section 5.2), in its own upright frame.

    Bone lengths and sizes are fitted to the silhouettes of all poses and cameras at once; then every blob takes its
    colour from the pictures. The same settings give what `sogjax actor` writes; it takes about half a minute.

    Args:
        recording: with example poses, and masks or empty background pictures for them; without, frames of its videos
            are used, or where these do not suit, keypoints beside them.
        subject: which one, where the example poses show several; `person_1`, `person_2` ... where there are none, and
            `actors=2` says how many people the videos show.
        settings: options of `sogjax actor`, such as `body="dog", symmetric=False, color="hsv"`.

    Raises:
        InputError: no example poses of the subject, no frames that can be used, pictures without masks, a pose that was
            not found; an unknown setting (with the nearest known one) or a wrong value.
    """
    return make_actors(_request(recording, subject, settings)).bodies[0]


def fit_actor(recording: Recording, subject: str | None = None, **settings: Any) -> MadeActor:
    """What `make_actor` gives, with all that was found on the way: example poses, silhouettes, standard deviations.

    Args:
        recording: as there.
        subject: as there.
        settings: as there.

    Raises:
        InputError: as there.
    """
    return actors_of_pictures(_request(recording, subject, settings))[0]


def _request(recording: Recording, subject: str | None, settings: dict[str, Any]) -> ActorRequest:
    config = _config(recording, subject, settings)
    return ActorRequest.from_config(with_cameras(recording, config.cameras), config)


def _config(recording: Recording, subject: str | None, settings: dict[str, Any]) -> ActorConfig:
    for key in ("out", "overwrite"):
        if key in settings:
            raise InputError(f"{key}: make_actor writes no file; use sogjax.save_actor(path, actor)")
    given = settings | {"recording": recording.path, "out": "", "subject": subject}
    return composed_config(ActorConfig, "actor", given.items())
