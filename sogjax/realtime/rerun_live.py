"""States in Rerun, with their latencies."""

import time
from collections.abc import Sequence

import numpy as np

from sogjax.io.motion import motion_from_poses
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.realtime.state import LiveState


class RerunLive:
    """Shows every state in Rerun, unless it is slower than they come.

    Raises:
        InputError: no viewer can be opened or answers, or the file cannot be written.
    """

    def __init__(self, target: str, recording: Recording, bodies: Sequence[Body]) -> None:
        from sogjax.view.rerun.live import LiveScene

        rests = [motion_from_poses(body, np.asarray(body.poses["rest"])[None], 1.0, up=recording.up) for body in bodies]
        self._scene, self._begin = LiveScene(target, recording, rests), None

    def send(self, state: LiveState) -> None:
        """Log a state."""
        stamps = state.stamps
        self._begin = stamps.exposed if self._begin is None else self._begin
        stages = {**stamps.stages, "so_far": time.monotonic() - stamps.arrived}
        actors = [(actor.world_from_joint, actor.tracked) for actor in state.actors]
        latencies = {stage: 1e3 * seconds for stage, seconds in stages.items()}
        self._scene.log(state.frame, stamps.exposed - self._begin, actors, latencies)

    def close(self) -> None:
        """End the recording."""
        self._scene.close()
