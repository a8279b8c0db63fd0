"""From a recording and its actors to their motion."""

from collections.abc import Sequence
from typing import Any, overload

from sogjax.api.settings import track_settings
from sogjax.data.motion import Motion
from sogjax.data.recording import Recording
from sogjax.energy import Term
from sogjax.engine.first_pose import searched_poses
from sogjax.engine.job import frame_range
from sogjax.engine.recordings import upright, with_cameras
from sogjax.engine.track import track_recording
from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.tracking.found_pose import FoundPose


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
        InputError: a wrong setting, unreadable pictures, no such frames, or a first pose that is not found.
    """
    config, actors = track_settings(**settings), actor_list(actor)
    motions = track_recording(with_cameras(recording, config.cameras), actors, config, terms).motions
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
    recording = with_cameras(recording, config.cameras)
    first, _ = frame_range(recording, config)
    found = searched_poses(recording, [upright(each, recording) for each in actors], config, first, terms)
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
