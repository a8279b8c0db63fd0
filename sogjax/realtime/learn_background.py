"""Pictures of the empty place: the middle colour of every pixel over ten seconds."""

import time
from pathlib import Path

import numpy as np

from sogjax.errors import InputError
from sogjax.io.image_file import write_image
from sogjax.io.recording import Recording
from sogjax.io.recording_files import BACKGROUND
from sogjax.realtime.opened_camera import OpenedCamera
from sogjax.realtime.start import opened_cameras
from sogjax.run.terminal import say
from sogjax.settings.live import LiveConfig

SECONDS = 10.0
SAMPLES = 15
"""Pictures of each camera that are looked at."""


def learn_place(recording: Recording, config: LiveConfig) -> list[Path]:
    """Write background/CAMERA.png of every camera into the folder of the place; nobody should be in view.

    Raises:
        InputError: a camera that does not open or stops, or pictures that are there and must stay.
    """
    folder = BACKGROUND.of(recording.path)
    paths = {name: folder / f"{name}.png" for name in recording.rig.names}
    known = [str(path) for path in recording.background.values() if path.stem in paths]
    if known and not config.overwrite:
        raise InputError(f"{known[0]}: is there already; give overwrite=true to replace the background")
    cameras = opened_cameras(recording, config.sources)
    say(f"learning the background for {SECONDS:g} s: leave the place empty")
    try:
        pictures = _samples(cameras)
    finally:
        for camera in cameras:
            camera.release()
    for name, of_camera in pictures.items():
        write_image(paths[name], np.median(np.stack(of_camera), axis=0).round().astype(np.uint8))
    for name, path in recording.background.items():
        if path.resolve() != paths[name].resolve():
            path.unlink(missing_ok=True)
    print(*paths.values(), sep="\n")
    return list(paths.values())


def _samples(cameras: list[OpenedCamera]) -> dict[str, list[np.ndarray]]:
    """Pictures spread over the time; those between are read too, or a camera's buffer would fill."""
    begin, found = time.monotonic(), {camera.name: list[np.ndarray]() for camera in cameras}
    while (passed := time.monotonic() - begin) < SECONDS:
        for camera in cameras:
            taken = camera.read()
            if taken is None:
                raise InputError(f"camera {camera.name}: ended while the background was learnt; try again")
            if len(found[camera.name]) <= passed / SECONDS * SAMPLES:
                found[camera.name].append(np.asarray(taken.picture))
    return found
