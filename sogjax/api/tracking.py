"""From a recording and its actors to their motion, with the settings of a track as keywords."""

from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, overload

from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run import build
from sogjax.run.actors import Actors
from sogjax.run.background import learn_background
from sogjax.run.initial_pose import PoseRequest, searched_poses
from sogjax.run.recordings import with_cameras
from sogjax.run.track import opened_clip, track_recording
from sogjax.search.found_pose import FoundPose
from sogjax.settings.compose import track_config
from sogjax.settings.option import is_inert
from sogjax.settings.run import OutputsConfig, TrackConfig

_NOT_HERE = {
    "recording": "is a separate argument, not a setting",
    "actor": "is a separate argument, not a setting",
    "actors": "is a setting of make_actor; give track a list of actors",
    "body": "is a setting of make_actor",
    "out": "no file is written; use motion.save(path)",
    "resume": "no file is written, so nothing can be resumed; use the command `sogjax track`",
    "overwrite": "no file is written, so nothing is overwritten",
}
"""Options of the command that have no meaning without its files, and why."""


def track_settings(**settings: Any) -> TrackConfig:
    """The settings that `track` and `make_tracker` use, every value filled in and checked.

    Names, defaults and errors are those of `sogjax track`, whose `--help` says the meaning and unit of each.

    Args:
        settings: values as keywords, groups as mappings or as the name of a set of options:
            `track_settings(preset="paper", stop=40, solver="lbfgs", energy={"limit_weight": 2.0})`.

    Raises:
        InputError: an unknown setting (with the nearest known one), a wrong value, or an option that only concerns
            the files of the command.
    """
    for key, reason in _NOT_HERE.items():
        if key in settings:
            raise InputError(f"{key}: {reason}")
    config = track_config(recording="", **settings)
    build.check(config)
    outputs = settings.get("outputs")
    for entry in fields(OutputsConfig):
        if isinstance(outputs, Mapping) and entry.name in outputs and is_inert(entry):
            raise InputError(f"outputs.{entry.name}: no file is written; use motion.save(path) or sogjax.write_rerun")
    return config


@overload
def track(recording: Recording, actor: Body, *, terms: Sequence[Term] = (), **settings: Any) -> Motion: ...


@overload
def track(
    recording: Recording, actor: Sequence[Body], *, terms: Sequence[Term] = (), **settings: Any
) -> list[Motion]: ...


def track(
    recording: Recording, actor: Body | Sequence[Body], *, terms: Sequence[Term] = (), **settings: Any
) -> Motion | list[Motion]:
    """The motion of an actor in a recording (Section 5.3), or of several, tracked together.

    What `sogjax track` does, without its files. Progress and warnings go to standard error.

    Args:
        recording: with the first frame's rough pose in `initial_pose.yaml`; it is searched for if there is none, or
            with `initial_pose="auto"`.
        actor: one, or a list of them with different names.
        terms: further terms of the energy, beside those of the settings.
        settings: as in `track_settings`; `start` and `stop` count from the recording's first frame.

    Returns:
        The motion, or a list with one for each actor in their order; metres and radians, in the recording's world.

    Raises:
        InputError: a wrong setting, unreadable pictures, no such frames, or an initial pose that is not found.
    """
    config, actors = track_settings(**settings), actor_list(actor)
    motions = track_recording(with_cameras(recording, config.cameras), actors, config, terms).result_so_far.motions
    found = [motions[each.name] for each in actors]
    return found[0] if isinstance(actor, Body) else found


@overload
def find_first_pose(recording: Recording, actor: Body, *, terms: Sequence[Term] = (), **settings: Any) -> FoundPose: ...


@overload
def find_first_pose(
    recording: Recording, actor: Sequence[Body], *, terms: Sequence[Term] = (), **settings: Any
) -> list[FoundPose]: ...


def find_first_pose(
    recording: Recording, actor: Body | Sequence[Body], *, terms: Sequence[Term] = (), **settings: Any
) -> FoundPose | list[FoundPose]:
    """The pose (dof,) of an actor, or of several, in the first frame to track, searched for without a hint.

    Places, headings and named poses are tried at once, and the best refined.

    Args:
        recording: whose pictures are looked at; an `initial_pose.yaml` is not.
        actor: one, or a list of them, of which each is searched for beside the others.
        terms: further terms of the energy, beside those of the settings.
        settings: as in `track_settings`; `start` is the frame.

    Returns:
        `pose` in radians and metres, whether it is `sure`, its `confidence` (0 to 1), its `energy`, and `margin`: by
        what share the next different pose is worse. For a list of actors a list in their order.

    Raises:
        InputError: nothing like an actor is seen in the frame; no such frame; a wrong setting.
    """
    config, actors = track_settings(**settings), actor_list(actor)
    clip = opened_clip(with_cameras(recording, config.cameras), config)
    background = learn_background(clip, config.images.background, config.images.cache)
    found = searched_poses(PoseRequest(clip, background, Actors(tuple(actors)), config, terms))
    return found[0] if isinstance(actor, Body) else found


def actor_list(actor: Body | Sequence[Body]) -> list[Body]:
    """One actor or several as a list.

    Raises:
        InputError: there is none, or two have the same name.
    """
    actors = [actor] if isinstance(actor, Body) else list(actor)
    names = [each.name for each in actors]
    if not actors:
        raise InputError("actor: the list is empty; give at least one actor")
    if len(set(names)) < len(names):
        raise InputError(f"actor: two actors are named {max(names, key=names.count)!r}; give each its own name")
    return actors
