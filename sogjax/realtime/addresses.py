"""Where messages go: an address and port, the path of a local socket; nothing here listens."""

import socket
from contextlib import suppress
from dataclasses import dataclass

from sogjax.errors import InputError

LOOPBACK = "127.0.0.1"


@dataclass(frozen=True)
class Address:
    """A host and port that get datagrams."""

    host: str
    port: int

    @classmethod
    def of(cls, key: str, text: str, usual: int) -> "Address":
        """The address of `HOST:PORT`, `PORT` or `HOST`; the host is this machine where none is named.

        Raises:
            InputError: the host is not known, or the port is no number from 1 to 65535.
        """
        host, _, port = text.rpartition(":") if ":" in text else ("", "", text)
        if not port.isdecimal():
            host, port = (text, str(usual)) if ":" not in text else (host, port)
        if not port.isdecimal() or not 1 <= int(port) <= 65535:
            raise InputError(f"{key}={text}: the port must be a number from 1 to 65535; write {LOOPBACK}:{usual}")
        host = host or LOOPBACK
        try:
            socket.getaddrinfo(host, int(port), type=socket.SOCK_DGRAM)
        except OSError as error:
            raise InputError(f"{key}={text}: the host {host!r} is not known; write {LOOPBACK}:{usual}") from error
        return cls(host, int(port))


class Datagrams:
    """Sends datagrams to an address, or to a local socket at a path; nobody need be there.

    Raises:
        InputError: a path that cannot be a socket's.
    """

    def __init__(self, target: Address | str) -> None:
        if isinstance(target, str) and not hasattr(socket, "AF_UNIX"):
            raise InputError(f"json={target}: this system has no local sockets; give HOST:PORT")
        if isinstance(target, str) and len(target.encode()) > 100:
            raise InputError(f"json={target}: the path of a socket has at most 100 bytes; choose a shorter one")
        family = (
            socket.AF_UNIX if isinstance(target, str) else socket.AF_INET6 if ":" in target.host else socket.AF_INET
        )
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._target = target if isinstance(target, str) else (target.host, target.port)

    def send(self, content: bytes) -> None:
        """Send one datagram; where nobody listens it is lost."""
        with suppress(OSError):
            self._socket.sendto(content, self._target)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
