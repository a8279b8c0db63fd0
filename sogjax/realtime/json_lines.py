"""States as lines of JSON; the schema is in the guide (docs/guide/live.md)."""

import json
import sys
import time
from typing import Any, Protocol, runtime_checkable

import numpy as np

from sogjax.model.body import Body
from sogjax.realtime.addresses import Address, Datagrams
from sogjax.realtime.state import ActorState, LiveState

VERSION = 1
TERMINAL = "-"
PORT = 39550
"""Where lines are sent unless told otherwise."""


@runtime_checkable
class Publisher(Protocol):
    """Passes states on."""

    def send(self, state: LiveState) -> None:
        """Pass a state on; may take long, since a thread of its own calls it."""
        ...

    def close(self) -> None:
        """End."""
        ...


def address_of(target: str) -> Address | str:
    """The address of `HOST:PORT`, or the path of a socket.

    Raises:
        InputError: such an address is not known.
    """
    return target if "/" in target or "\\" in target else Address.of("json", target, PORT)


class JsonLines:
    """Sends every state as one line: to an address, a local datagram socket, or the terminal (`-`).

    Args:
        target: `HOST:PORT`, a path, or `-`.
        bodies: the actors, for the names of what is sent.
        cameras: names of the cameras.

    Raises:
        InputError: such an address is not known.
    """

    def __init__(self, target: str, bodies: tuple[Body, ...], cameras: tuple[str, ...]) -> None:
        self._bodies, self._cameras = {body.name: body for body in bodies}, cameras
        self._datagrams = None
        if target != TERMINAL:
            self._datagrams = Datagrams(address_of(target))

    def send(self, state: LiveState) -> None:
        """Send one line."""
        line = json.dumps(message_of(state, self._bodies, self._cameras), separators=(",", ":")) + "\n"
        if self._datagrams is None:
            sys.stdout.write(line)
            sys.stdout.flush()
        else:
            self._datagrams.send(line.encode())

    def close(self) -> None:
        """Close the socket."""
        if self._datagrams is not None:
            self._datagrams.close()


def message_of(state: LiveState, bodies: dict[str, Body], cameras: tuple[str, ...]) -> dict[str, Any]:
    """A state as JSON has it; times are seconds since 1970, lengths metres, angles radians."""
    since_1970 = time.time() - time.monotonic()
    stamps = {key: getattr(state.stamps, key) for key in ("exposed", "arrived", "handed_over", "solved")}
    times = {key: round(value + since_1970, 6) for key, value in stamps.items()}
    return {
        "version": VERSION,
        "frame": state.frame,
        "times": times | {"sent": round(time.time(), 6)},
        "cameras": [name for name, there in zip(cameras, state.present, strict=True) if there],
        "actors": [_actor_message(actor, bodies[actor.name]) for actor in state.actors],
    }


def _actor_message(actor: ActorState, body: Body) -> dict[str, Any]:
    joints = actor.world_from_joint[:, :3, 3]
    return {
        "name": actor.name,
        "tracked": actor.tracked,
        "explained": round(actor.explained, 3),
        "pose": dict(zip(body.skeleton.dof_names, _rounded(actor.pose), strict=True)),
        "joints": dict(zip(body.skeleton.names, map(_rounded, joints), strict=True)),
    }


def _rounded(values: np.ndarray) -> list[float]:
    return [round(float(value), 5) for value in values]
