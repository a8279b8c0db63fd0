"""The avatar protocol VMC over OSC (protocol.vmc.info): Unity's bones, turned against the T-pose.

Unity's world is left-handed: x to the right, y up, z forward; metres. An upright body looks along its x, has y to its
left and z up. So (x, y, z) becomes (-y, z, x).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message import OscMessage
from pythonosc.osc_message_builder import OscMessageBuilder
from scipy.spatial.transform import Rotation

from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.model.rotation import world_from_upright
from sogjax.realtime.addresses import Address, Datagrams
from sogjax.realtime.state import ActorState, LiveState

PORT = 39539
LARGEST = 1472
"""Bytes of a datagram that no network takes apart: a packet of 1500, less the heads of IP and UDP."""
UNITY_FROM_UPRIGHT = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])

_TRUNK = (
    ("Hips", None, "root_"),
    ("Spine", "Hips", "spine2_"),
    ("Chest", "Spine", "spine5_"),
    ("Neck", "Chest", "neck_"),
    ("Head", "Neck", "head_"),
)
_SIDE = (
    ("Shoulder", "Chest", "clavicle_"),
    ("UpperArm", "Shoulder", "upper_arm_"),
    ("LowerArm", "UpperArm", "forearm_roll1"),
    ("Hand", "LowerArm", "wrist_"),
    ("UpperLeg", "Hips", "hip_"),
    ("LowerLeg", "UpperLeg", "knee"),
    ("Foot", "LowerLeg", "ankle_"),
)
BONES: tuple[tuple[str, str | None, str], ...] = _TRUNK + tuple(
    (f"{side}{bone}", above if above in ("Chest", "Hips") else f"{side}{above}", f"{side.lower()}_{joint}")
    for side in ("Left", "Right")
    for bone, above, joint in _SIDE
)
"""Unity's bones that are tracked, the bone above each, and what the names of its joints begin with; the last of these
turns with all of them. The upper chest stays as it is, since many avatars have none."""
_PLACED = {"UpperArm": "shoulder_", "LowerArm": "elbow"}
"""Bones that begin at other joints than those that turn them."""
_FINGERS = {"Thumb": 0.03, "Index": 0.025, "Middle": 0.005, "Ring": -0.015, "Little": -0.03}
"""How far forward of the middle of the hand a finger begins; metres."""
_PARTS = {"Proximal": 0.09, "Intermediate": 0.04, "Distal": 0.025}
"""How far out each part of a finger begins from the one before; metres."""
STILL: dict[str, tuple[float, float, float]] = {
    **{"UpperChest": (0.0, 0.0, 0.0), "Jaw": (0.0, 0.0, 0.06)},
    **{"LeftEye": (-0.03, 0.07, 0.07), "RightEye": (0.03, 0.07, 0.07)},
    **{"LeftToes": (0.0, -0.06, 0.12), "RightToes": (0.0, -0.06, 0.12)},
    **{
        f"{side}{finger}{part}": (sign * out, 0.0, forward if part == "Proximal" else 0.0)
        for side, sign in (("Left", -1.0), ("Right", 1.0))
        for finger, forward in _FINGERS.items()
        for part, out in _PARTS.items()
    },
}
"""Unity's bones that are not tracked, with where a usual one begins in the bone above: receivers that take places over,
too, must find none at 0. They are sent unturned."""


@dataclass(frozen=True)
class Bone:
    """One of Unity's bones."""

    name: str
    above: int
    """The bone above it, or -1."""
    turns: int
    """The joint whose frame turns with it."""
    begins: int
    """The joint at its beginning."""


@dataclass(frozen=True)
class Avatar:
    """How the joints of a body move Unity's bones; in Unity's axes."""

    bones: tuple[Bone, ...]
    unity_from_world: Float[np.ndarray, "3 3"]
    t_pose: Float[np.ndarray, "bone 3 3"]
    """Rotations of the bones' joints in the T-pose."""
    offsets: Float[np.ndarray, "bone 3"]
    """From the beginning of the bone above, in the T-pose; metres."""

    @classmethod
    def of(cls, body: Body, up: str) -> "Avatar":
        """The avatar of a body that stands upright in a world with the vertical `up`.

        Raises:
            InputError: the body has no such bones, or no T-pose.
        """
        if "tpose" not in body.poses:
            raise InputError(
                f"vmc: the actor {body.name!r} has no pose called tpose; VMC is for bodies made from human"
            )
        bones = tuple(_bones(body))
        turn = UNITY_FROM_UPRIGHT @ world_from_upright(up).T
        frames = np.asarray(body.skeleton.world_from_joint(jnp.asarray(body.poses["tpose"])), float)
        origins = frames[[bone.begins for bone in bones], :3, 3] @ turn.T
        above = np.array([bone.above for bone in bones])
        offsets = origins - np.where(above[:, None] < 0, 0.0, origins[above])
        return cls(bones, turn, frames[[bone.turns for bone in bones], :3, :3], offsets)

    def posed(
        self, world_from_joint: Float[np.ndarray, "joint 4 4"]
    ) -> tuple[Float[np.ndarray, "3"], Float[np.ndarray, "bone 3"], Float[np.ndarray, "bone 4"]]:
        """Where the root is, and the position and rotation (x y z w) of every bone in the one above it."""
        turn, frames = self.unity_from_world, np.asarray(world_from_joint, float)
        now = frames[[bone.turns for bone in self.bones], :3, :3]
        turned = turn @ now @ np.swapaxes(self.t_pose, -1, -2) @ turn.T
        above = np.array([bone.above for bone in self.bones])
        parents = np.where(above[:, None, None] < 0, np.eye(3), turned[above])
        local = np.swapaxes(parents, -1, -2) @ turned
        hips = turn @ frames[self.bones[0].begins, :3, 3]
        root, offsets = hips * [1.0, 0.0, 1.0], self.offsets.copy()
        offsets[0] = hips - root
        return root, offsets, Rotation.from_matrix(local).as_quat()


def _bones(body: Body) -> Iterator[Bone]:
    names, known = body.skeleton.names, [bone for bone, _, _ in BONES]
    last = lambda start: max((k for k, name in enumerate(names) if name.startswith(start)), default=None)
    for bone, above, start in BONES:
        turns = last(start)
        if turns is None:
            raise InputError(
                f"vmc: the actor {body.name!r} has no joints called {start}...; VMC is for bodies made from human"
            )
        side = start.partition("_")[0]
        placed = next((last(f"{side}_{of}") for part, of in _PLACED.items() if bone.endswith(part)), None)
        yield Bone(bone, -1 if above is None else known.index(above), turns, turns if placed is None else placed)


class Vmc:
    """Sends actors as avatars: the first to a port, each other one to the next port.

    Raises:
        InputError: the address is not known, or an actor cannot be an avatar.
    """

    def __init__(self, target: str, bodies: tuple[Body, ...], up: str) -> None:
        address = Address.of("vmc", target, PORT)
        if address.port + len(bodies) > 65536:
            raise InputError(f"vmc={target}: {len(bodies)} actors need as many ports up to 65535; give a lower one")
        self._avatars = [Avatar.of(body, up) for body in bodies]
        self._sockets = [Datagrams(Address(address.host, address.port + k)) for k in range(len(bodies))]
        self._begin: float | None = None

    def send(self, state: LiveState) -> None:
        """Send the bones of all actors; of those that are not tracked only that they are not."""
        actors, exposed = state.actors or (None,) * len(self._avatars), state.stamps.exposed
        self._begin = exposed if self._begin is None else self._begin
        for actor, avatar, datagrams in zip(actors, self._avatars, self._sockets, strict=True):
            for packet in packets_of(actor, avatar, exposed - self._begin):
                datagrams.send(packet)

    def close(self) -> None:
        """Close the sockets."""
        for each in self._sockets:
            each.close()


def packets_of(actor: ActorState | None, avatar: Avatar, seconds: float) -> Iterator[bytes]:
    """The messages about an actor in bundles; `seconds` since the first are told: OSC's numbers are short."""
    tracked = actor is not None and actor.tracked
    messages = [_message("/VMC/Ext/OK", int(tracked)), _message("/VMC/Ext/T", float(seconds))]
    if actor is not None and tracked:
        root, offsets, turns = avatar.posed(actor.world_from_joint)
        messages.append(_message("/VMC/Ext/Root/Pos", "root", *map(float, root), 0.0, 0.0, 0.0, 1.0))
        for bone, offset, turn in zip(avatar.bones, offsets, turns, strict=True):
            messages.append(_message("/VMC/Ext/Bone/Pos", bone.name, *map(float, offset), *map(float, turn)))
        messages += _STILL
    yield from bundled(messages)


def bundled(messages: list[OscMessage]) -> Iterator[bytes]:
    """Messages in bundles that are small enough."""
    head, size, waiting = 16, 16, []
    for message in messages:
        if size + 4 + message.size > LARGEST and waiting:
            yield _bundle(waiting)
            size, waiting = head, []
        waiting.append(message)
        size += 4 + message.size
    yield _bundle(waiting)


def _bundle(messages: list[OscMessage]) -> bytes:
    builder = OscBundleBuilder(IMMEDIATELY)
    for message in messages:
        builder.add_content(message)
    return builder.build().dgram


def _message(address: str, *values: str | float | int) -> OscMessage:
    builder = OscMessageBuilder(address)
    for value in values:
        builder.add_arg(value)
    return builder.build()


_STILL = [_message("/VMC/Ext/Bone/Pos", name, *place, 0.0, 0.0, 0.0, 1.0) for name, place in STILL.items()]
