"""Joint positions as a stream of Lab Streaming Layer; needs the extra `lsl`."""

import time
from collections.abc import Sequence
from importlib import import_module

import numpy as np

from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.realtime.state import LiveState


class LabStream:
    """A stream with x, y, z of every joint of every actor in metres; NaN while an actor is not tracked.

    Samples carry the time when their pictures were taken, on the clock of the layer. The layer itself looks for
    listeners on the network; `lsl_api.cfg` keeps it to one machine.

    Raises:
        InputError: the extra is not installed.
    """

    def __init__(self, name: str, bodies: Sequence[Body], rate: float) -> None:
        try:
            pylsl = import_module("pylsl")
        except (ImportError, RuntimeError) as error:
            raise InputError(f"lsl={name}: needs the extra lsl; pip install 'sogjax[lsl]'") from error
        self._clock, self._sizes = pylsl.local_clock, [body.skeleton.num_joints for body in bodies]
        info = pylsl.StreamInfo(name, "MoCap", 3 * sum(self._sizes), rate, pylsl.cf_float32, f"sogjax-{name}")
        channels = info.desc().append_child("channels")
        for body in bodies:
            for joint in body.skeleton.names:
                for axis in "XYZ":
                    channel = channels.append_child("channel")
                    channel.append_child_value("label", f"{body.name}/{joint}/{axis}")
                    channel.append_child_value("type", f"Position{axis}").append_child_value("unit", "meters")
        self._outlet = pylsl.StreamOutlet(info)

    def send(self, state: LiveState) -> None:
        """Push one sample."""
        parts = [np.full(3 * size, np.nan) for size in self._sizes]
        for k, actor in enumerate(state.actors):
            if actor.tracked:
                parts[k] = actor.world_from_joint[:, :3, 3].ravel()
        taken = self._clock() - (time.monotonic() - state.stamps.exposed)
        self._outlet.push_sample(np.concatenate(parts).tolist(), taken)

    def close(self) -> None:
        """End the stream."""
        del self._outlet
