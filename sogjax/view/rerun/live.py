"""Actors in Rerun while they are tracked: a viewer that is opened or connected to, or a file."""

import socket
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
import rerun as rr
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.view.bones import actor_palette, bones_from_motion
from sogjax.view.rerun.layout import live_layout
from sogjax.view.rerun.scene import Scene
from sogjax.view.rerun.stream import FRAME, TIME, actor_entity

MEMORY = "500MB"
"""Most that the viewer keeps; the oldest goes."""
LOOPBACK, PORT = "127.0.0.1", 9876
OPENS_WITHIN = 20.0
"""Seconds that a viewer may take to open."""


class LiveScene:
    """Skeletons and figures, logged as they come.

    Args:
        target: `viewer`, `HOST:PORT`, or a file `.rrd`.
        recording: whose cameras are shown.
        rests: a motion of one frame of each actor, which tells its bones.

    Raises:
        InputError: no viewer can be opened or answers there, or the file cannot be written.
    """

    def __init__(self, target: str, recording: Recording, rests: Sequence[Motion]) -> None:
        self._bones = [bones_from_motion(rest) for rest in rests]
        self._names = [rest.actor for rest in rests]
        self._stream = rr.RecordingStream("sogjax")
        self._connect(target)
        self._scene = Scene(self._stream, recording, 320)
        for rest in rests:
            self._scene.extend(rest.blob_means)
        self._scene.log_cameras()
        self._stream.send_blueprint(live_layout({"latency": "Latency, ms"}, self._scene.eye()))

    def log(
        self,
        frame: int,
        seconds: float,
        actors: Sequence[tuple[Float[np.ndarray, "joint 4 4"], bool]],
        latencies: dict[str, float],
    ) -> None:
        """Log where the joints of every actor are, whether it is tracked, and latencies by stage in milliseconds."""
        self._stream.set_time(FRAME, sequence=frame)
        self._stream.set_time(TIME, duration=seconds)
        for k, (name, bones) in enumerate(zip(self._names, self._bones, strict=True)):
            entity = f"{actor_entity(name)}/skeleton"
            if k >= len(actors) or not actors[k][1]:
                self._stream.log(entity, rr.Clear(recursive=False))
                continue
            points = actors[k][0][bones.joints][:, :3, 3]
            edges = bones.edges[(bones.edges < bones.num_joints).all(axis=1)]
            sides = bones.sides[(bones.edges < bones.num_joints).all(axis=1)]
            self._stream.log(entity, rr.LineStrips3D(points[edges], colors=actor_palette(k)[sides], radii=[0.012]))
        for stage, value in latencies.items():
            self._stream.log(f"/curves/latency/{stage}", rr.Scalars(value))

    def close(self) -> None:
        """End the recording."""
        self._stream.flush()
        self._stream.disconnect()

    def _connect(self, target: str) -> None:
        try:
            if target.endswith(".rrd"):
                Path(target).parent.mkdir(parents=True, exist_ok=True)
                self._stream.save(target)
                return
            host, port = _opened_viewer() if target == "viewer" else _answering(target)
            self._stream.connect_grpc(f"rerun+http://{host}:{port}/proxy")
        except InputError:
            raise
        except (RuntimeError, OSError, ValueError) as error:
            reason = str(error).splitlines()[0]
            raise InputError(
                f"rerun={target}: does not work ({reason}); give viewer, HOST:PORT, or FILE.rrd"
            ) from error


def _opened_viewer() -> tuple[str, int]:
    """A viewer that only this machine reaches, opened now.

    Raises:
        InputError: its port is in use, or it does not open.
    """
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((LOOPBACK, PORT))
        except OSError as error:
            raise InputError(
                f"rerun=viewer: the port {PORT} is in use; if a viewer is open, give rerun={LOOPBACK}:{PORT}"
            ) from error
    command = [sys.executable, "-m", "rerun", "--bind", LOOPBACK, "--port", str(PORT), "--memory-limit", MEMORY]
    viewer = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
    stop = time.monotonic() + OPENS_WITHIN
    while time.monotonic() < stop and viewer.poll() is None:
        with suppress(OSError), socket.create_connection((LOOPBACK, PORT), 1.0):
            return LOOPBACK, PORT
        time.sleep(0.2)
    raise InputError("rerun=viewer: Rerun's viewer does not open here; give rerun=FILE.rrd and open that later")


def _answering(target: str) -> tuple[str, int]:
    """The address of a viewer that is open.

    Raises:
        InputError: none is.
    """
    host, _, port = target.rpartition(":")
    host = host or LOOPBACK
    try:
        with socket.create_connection((host, int(port)), 2.0):
            return host, int(port)
    except (OSError, ValueError) as error:
        raise InputError(f"rerun={target}: no viewer answers there; open one with `rerun`, or give viewer") from error
