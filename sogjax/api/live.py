"""The actors while pictures arrive, as an iterator."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from sogjax.api.tracking import actor_list
from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.realtime.start import checked, recording_of, session_of
from sogjax.realtime.state import LiveState
from sogjax.settings.compose import composed_config
from sogjax.settings.live import LiveConfig

_NOT_HERE = {
    "actor": "is a separate argument, not a setting",
    "out": "no file is written; use the command `sogjax live`",
    "overwrite": "no file is written, so nothing is overwritten",
    "learn_background": "is only for the command `sogjax live`",
}


def live(
    recording: Recording | str | Path, actor: Body | Sequence[Body], *, terms: Sequence[Term] = (), **settings: Any
) -> Iterator[LiveState]:
    """The actors from moment to moment, while pictures arrive from cameras or a replayed recording.

    The cameras open at once and begin with the first state that is asked for. Whoever takes long over a state misses
    those in between, and no delay grows. Closing the iterator closes the cameras::

        for state in sogjax.live("studio", actor, sources={"left": 0, "right": 1}):
            for person in state.actors:
                print(state.frame, person.tracked, person.world_from_joint[:, :3, 3])

    Args:
        recording: a recording, or the folder of one, or one that only has the cameras' calibration and background.
        actor: one, or a list of them.
        terms: further terms of the energy, beside those of the settings.
        settings: options of `sogjax live`, such as `replay=True, speed=1.0, vmc="127.0.0.1:39539"`.

    Returns:
        An iterator of states; `actors` is empty while nobody is in view.

    Raises:
        InputError: a wrong setting, a camera that does not open, an address that is not known, or a replay whose
            initial pose is not found.
    """
    for key, reason in _NOT_HERE.items():
        if key in settings:
            raise InputError(f"{key}: {reason}")
    actors = actor_list(actor)
    path = recording.path if isinstance(recording, Recording) else recording
    if isinstance(recording, Recording) and "cameras" not in settings:
        settings |= {"cameras": list(recording.rig.names)}
    config: LiveConfig = composed_config(LiveConfig, "live", (settings | {"recording": path}).items())
    checked(config)
    session = session_of(recording_of(config), actors, config, None, terms)
    return (replace(state, tracked_frame=None) for state in session.states())
