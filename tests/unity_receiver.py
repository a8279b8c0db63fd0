"""A receiver of VMC written from the protocol's description alone: it reads OSC by hand and poses Unity's avatar."""

import socket
import struct

import numpy as np


class Receiver:
    """Listens on a free port of this machine, and keeps what came last of every bone."""

    def __init__(self, listens=True):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM) if listens else None
        if self.socket:
            self.socket.bind(("127.0.0.1", 0))
            self.socket.settimeout(2.0)
        self.bones, self.root, self.ok, self.time, self.sizes = {}, None, None, None, []

    @property
    def port(self):
        return self.socket.getsockname()[1]

    def receive(self, count=1):
        """Read so many datagrams."""
        for _ in range(count):
            self.take(self.socket.recv(65536))

    def close(self):
        self.socket.close()

    def take(self, content):
        self.sizes.append(len(content))
        for address, values in messages(content):
            if address == "/VMC/Ext/Bone/Pos":
                self.bones[values[0]] = (np.array(values[1:4]), np.array(values[4:8]))
            elif address == "/VMC/Ext/Root/Pos":
                self.root = (np.array(values[1:4]), np.array(values[4:8]))
            elif address == "/VMC/Ext/OK":
                self.ok = values[0]
            elif address == "/VMC/Ext/T":
                self.time = values[0]

    def world(self, parents):
        """Position and turn of every bone in Unity's world; `parents` names the bone above each."""
        found = {}
        for bone, above in parents.items():
            place, turn = self.root if above is None else found[above]
            local, rotation = self.bones[bone]
            found[bone] = (place + turned(turn, local), multiplied(turn, rotation))
        return found


def messages(content):
    """Addresses and arguments of a datagram (OSC 1.0), bundles opened."""
    if content.startswith(b"#bundle\0"):
        place = 16
        while place < len(content):
            (size,) = struct.unpack(">i", content[place : place + 4])
            yield from messages(content[place + 4 : place + 4 + size])
            place += 4 + size
        return
    address, place = text(content, 0)
    types, place = text(content, place)
    values = []
    for kind in types[1:]:
        if kind == "s":
            value, place = text(content, place)
        else:
            (value,) = struct.unpack(f">{kind}", content[place : place + 4])
            place += 4
        values.append(value)
    yield address, values


def text(content, place):
    end = content.index(b"\0", place)
    return content[place:end].decode(), place + 4 * ((end - place) // 4 + 1)


def multiplied(a, b):
    """Product of quaternions x y z w: b first."""
    av, aw, bv, bw = a[:3], a[3], b[:3], b[3]
    return np.append(aw * bv + bw * av + np.cross(av, bv), aw * bw - av @ bv)


def turned(quaternion, vector):
    axis, w = quaternion[:3], quaternion[3]
    return vector + 2.0 * np.cross(axis, np.cross(axis, vector) + w * vector)
