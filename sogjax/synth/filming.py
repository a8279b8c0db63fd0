"""Films a stage with its cameras: plates, stills and videos, shared out to several processes.

They are processes of their own (`python -m sogjax.synth.filming`, the order on standard input), not those of
`multiprocessing`: these work from notebooks, from scripts without a main guard and inside pytest alike.
"""

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float, UInt8

from sogjax.errors import InputError
from sogjax.io import recording_files
from sogjax.io.image_file import write_image, write_mask
from sogjax.io.video import VideoWriter
from sogjax.synth.anatomy import Pose
from sogjax.synth.exercises import EXAMPLE_POSES
from sogjax.synth.figure import Figure
from sogjax.synth.light import drifted
from sogjax.synth.picture import Plate, Shadows, Shot, plate_of, shot_of
from sogjax.synth.scene import Scene
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import Stage, stage_of
from sogjax.synth.views import Sensor

_NOISE, _VIDEO, _STILL, _EMPTY = 7, 0, 1, 2
"""Streams of random numbers: pictures have the same noise whichever process renders them."""

_KEPT_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(32 << 20), "MALLOC_TRIM_THRESHOLD_": str(1 << 30)}
"""Memory of arrays is used again rather than given back to Linux, which clears it anew: a tenth of the time."""


def num_pictures(settings: SynthSettings) -> int:
    """How many pictures a recording takes, which is how often `film` yields for all cameras together."""
    stills = len(EXAMPLE_POSES) * settings.actors if settings.example_poses else 0
    return settings.cameras * (1 + stills + settings.frames)


def example_folder(stage: Stage, actor: int, pose: str) -> str:
    """Name of the folder of an example pose."""
    return pose if stage.settings.actors == 1 else f"{stage.settings.actor_names[actor]}_{pose}"


@dataclass(frozen=True)
class EmptyView:
    """What a camera shows of the empty scene; most of every picture is taken from there."""

    sensor: Sensor
    plate: Plate

    @cached_property
    def levels(self) -> Float[np.ndarray, "row column 3"]:
        """The picture without people and without noise, in grey levels."""
        return self.sensor.without_noise(self.plate.total)

    def empty(self, rng: np.random.Generator) -> UInt8[np.ndarray, "row column 3"]:
        """The picture without people."""
        return self.sensor.recorded(self.levels.copy(), rng)

    def recorded(
        self, shot: Shot, rng: np.random.Generator, drift: Float[np.ndarray, "3"] | None = None
    ) -> UInt8[np.ndarray, "row column 3"]:
        """The picture of a shot; `drift` is what is left of the room's red, green and blue light, if that changes."""
        if drift is not None:
            return self.sensor.exposed(shot.light * drift, rng)
        levels, changed = self.levels.copy(), shot.changed.slices
        levels[changed] = self.sensor.without_noise(shot.light[changed])
        return self.sensor.recorded(levels, rng)


def film(stage: Stage, cameras: Sequence[int], folder: Path) -> Iterator[None]:
    """Write everything that some cameras see into a recording's folder; yields after each picture."""
    views = {}
    for camera in cameras:
        views[camera] = _empty_view(stage, stage.scene, camera)
        if stage.settings.background:
            empty = views[camera].empty(_rng(stage, camera, _EMPTY, 0))
            write_image(recording_files.BACKGROUND.of(folder) / f"{stage.views[camera].name}.jpg", empty)
        yield
    if stage.settings.example_poses:
        # before tables and chairs are brought in
        bare = stage.scene is stage.bare
        yield from _stills(stage, views if bare else {k: _empty_view(stage, stage.bare, k) for k in views}, folder)
    yield from _videos(stage, views, folder)


def _empty_view(stage: Stage, scene: Scene, camera: int) -> EmptyView:
    return EmptyView(stage.sensors[camera], plate_of(scene, stage.views[camera]))


def _stills(stage: Stage, views: dict[int, EmptyView], folder: Path) -> Iterator[None]:
    for actor, person in enumerate(stage.people):
        for number, pose in enumerate(EXAMPLE_POSES):
            place = recording_files.EXAMPLE_POSES.of(folder) / example_folder(stage, actor, pose)
            for camera, shot in _shots(stage.bare, stage, views, [person], [stage.example_pose(actor, pose)]):
                rng = _rng(stage, camera, _STILL, 10 * actor + number)
                name = stage.views[camera].name
                write_image(place / f"{name}.jpg", views[camera].recorded(shot, rng))
                write_mask(place / f"{name}.mask.png", shot.mask)
                yield


def _videos(stage: Stage, views: dict[int, EmptyView], folder: Path) -> Iterator[None]:
    with ExitStack() as stack:
        writers = {}
        for camera in views:
            path = recording_files.VIDEOS.of(folder) / f"{stage.views[camera].name}.mp4"
            writers[camera] = stack.enter_context(VideoWriter(path, stage.settings.fps))
        for frame in range(stage.settings.frames):
            drift = _drift(stage, frame)
            for camera, shot in _shots(stage.scene, stage, views, stage.people, stage.poses(frame)):
                rng = _rng(stage, camera, _VIDEO, frame)
                writers[camera].write(views[camera].recorded(shot, rng, drift))
                yield


def _drift(stage: Stage, frame: int) -> Float[np.ndarray, "3"] | None:
    """What is left of the room's light at a frame; None: all."""
    drift = stage.settings.light_drift
    return drifted(drift, frame / max(stage.settings.frames - 1, 1)) if drift else None


def _shots(
    scene: Scene, stage: Stage, views: dict[int, EmptyView], people: Sequence[Figure], poses: Sequence[Pose]
) -> Iterator[tuple[int, Shot]]:
    """What each camera sees of people in poses; surface and shadows are made once for all cameras."""
    meshes = [person.posed(pose) for person, pose in zip(people, poses, strict=True)]
    furniture = None if scene.props is None else scene.shadow
    shadows = Shadows.of(meshes, furniture) if stage.settings.shadows else None
    for camera, empty in views.items():
        yield camera, shot_of(stage.views[camera], empty.plate, people, meshes, shadows)


def _rng(stage: Stage, camera: int, kind: int, number: int) -> np.random.Generator:
    return np.random.default_rng([stage.settings.seed, _NOISE, camera, kind, number])


def num_workers(pictures: int, cameras: int) -> int:
    """How many processes to use: fewer than 60 pictures are made sooner than another process has started."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, cameras, pictures // 60))


def film_all(stage: Stage, folder: Path, workers: int) -> Iterator[None]:
    """Film with every camera; yields after each picture. With one worker, in this process.

    Raises:
        InputError: the folder cannot be written.
    """
    cameras = range(len(stage.views))
    if workers == 1:
        yield from film(stage, cameras, folder)
        return
    done: queue.Queue[str] = queue.Queue()
    processes = [_started(stage.settings, list(cameras[k::workers]), folder, done) for k in range(workers)]
    try:
        ended = 0
        while ended < len(processes):
            message = done.get()
            if message == "picture":
                yield
            elif message == "end":
                ended += 1
            elif message.startswith("refused "):
                raise InputError(message.removeprefix("refused "))
            elif message.startswith("failed"):
                raise RuntimeError(f"a rendering process {message}")
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _started(
    settings: SynthSettings, cameras: Sequence[int], folder: Path, done: "queue.Queue[str]"
) -> "subprocess.Popen[str]":
    """A process that films with some cameras; a thread passes on what it tells, then `end`."""
    paths = [str(Path(__file__).resolve().parents[2]), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in paths if path)}
    # one thread each: the processes are as many as the cores
    environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "JAX_PLATFORMS": "cpu"} | _KEPT_MEMORY
    log = (folder / f".worker_{cameras[0]}.log").open("w+", encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, "-m", "sogjax.synth.filming"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
        env=environment,
    )
    assert process.stdin is not None
    json.dump({"settings": asdict(settings), "cameras": list(cameras), "folder": str(folder)}, process.stdin)
    process.stdin.close()

    def listen() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            done.put(line.strip())
        process.stdout.close()
        code = process.wait()
        log.seek(0)
        done.put("end" if code == 0 else f"failed: {log.read()[-2000:]}")
        log.close()

    threading.Thread(target=listen, daemon=True).start()
    return process


def _work() -> None:
    """Read the order (settings, cameras, folder) as JSON, film, and write a line for every picture."""
    order = json.load(sys.stdin)
    stage = stage_of(SynthSettings(**order["settings"]))
    try:
        for _ in film(stage, order["cameras"], Path(order["folder"])):
            print("picture", flush=True)
    except InputError as error:  # a full disk
        print("refused", " ".join(str(error).split()), flush=True)


if __name__ == "__main__":
    _work()
