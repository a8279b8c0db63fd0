"""What stays of a live session: the motion, in a log on disk that becomes motion.npz, and the videos on demand."""

import shutil
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from threading import Condition, Thread
from typing import Any

import numpy as np
import yaml

from sogjax.errors import InputError
from sogjax.io.calibration.load import save_calibration
from sogjax.io.files import write_file
from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.frame_table import FrameLog, read_frames_log
from sogjax.io.motion import FRAMES_AT_ONCE
from sogjax.io.recording import Recording
from sogjax.io.recording_files import BACKGROUND, CALIBRATION, OCCLUDERS, SETTINGS, VIDEOS
from sogjax.io.video import VideoWriter
from sogjax.model.body import Body
from sogjax.model.yuv_picture import YuvPicture
from sogjax.realtime.pictures import FrameSet, Picture
from sogjax.realtime.state import LiveState
from sogjax.run.frames import rows_of
from sogjax.run.run_files import MOTION
from sogjax.run.terminal import say

LOG = "frames"
RATE_OFF = 0.02
"""Part by which cameras may be slower or faster than was said of them."""
PICTURES_BEHIND = 16
"""Pictures of a camera that wait for its video, at most."""


class MotionRecorder:
    """Writes frames to a log as they come; at the end they become the motions.

    Args:
        folder: of the log and the motions.
        bodies: the actors, as they stand in the world.
        clip: what motions have to know.
    """

    def __init__(self, folder: Path, bodies: Sequence[Body], clip: ClipFacts) -> None:
        self._folder, self._bodies, self._clip = folder, bodies, clip
        shutil.rmtree(folder / LOG, ignore_errors=True)
        self._log = FrameLog(folder / LOG)
        self._waiting: list[LiveState] = []

    def take(self, state: LiveState) -> None:
        """Take a state; those in which nobody is tracked leave a gap."""
        if state.tracked_frame is not None:
            self._waiting.append(state)
        if len(self._waiting) >= FRAMES_AT_ONCE:
            self._write()

    def finish(self) -> list[Path]:
        """Write the motions; returns their files, none where nobody was tracked.

        Raises:
            InputError: the folder cannot be written.
        """
        self._write()
        self._log.__exit__()
        table, files = read_frames_log(self._folder / LOG), []
        if table is not None and len(table):
            motions = motions_of(table, self._bodies, self._clip)
            for name, motion in motions.items():
                files.append(MOTION.of(self._folder, name, len(motions)))
                motion.save(files[-1])
        shutil.rmtree(self._folder / LOG, ignore_errors=True)
        return files

    def _write(self) -> None:
        states, self._waiting = self._waiting, []
        frames = [state.tracked_frame for state in states if state.tracked_frame is not None]
        if frames:
            self._log.append(rows_of(frames, [state.frame for state in states]))


class VideoRecorder:
    """Writes a video of each camera, within a `with` block, and what makes a recording of them.

    Every set is a frame; where a camera has no picture its last one stands again and is listed as missing. Pictures are
    kept as they came, which cells are made of again.

    Args:
        folder: of the new recording.
        recording: whose calibration and background are taken over.
        fps: frames per second of the videos.

    Raises:
        InputError: the folder holds a recording, or cannot be written.
    """

    def __init__(self, folder: Path, recording: Recording, fps: float) -> None:
        if SETTINGS.of(folder).exists() or VIDEOS.of(folder).exists():
            raise InputError(f"record={folder}: holds a recording; choose another folder")
        self._folder, self._recording, self._fps = folder, recording, fps
        self._writers = [_CameraVideo(VIDEOS.of(folder) / f"{name}.mp4", fps) for name in recording.rig.names]
        self._missing: list[list[list[int]]] = [[] for _ in recording.rig.names]
        self._frames = 0
        self._times = (0.0, 0.0)
        """When the first and the last frame of cameras were taken."""

    def __enter__(self) -> "VideoRecorder":
        for writer in self._writers:
            writer.start()
        return self

    def put(self, found: FrameSet) -> None:
        """Take a set; never waits: where the disk is slow a camera's picture is missing."""
        for camera, writer in enumerate(self._writers):
            seen = found.pictures.get(camera)
            if not writer.put(None if seen is None else seen.picture):
                spans = self._missing[camera]
                if spans and spans[-1][1] == self._frames - 1:
                    spans[-1][1] = self._frames
                else:
                    spans.append([self._frames, self._frames])
        if found.number is None:
            self._times = (self._times[0] if self._frames else found.exposed, found.exposed)
        self._frames += 1

    def _rate(self) -> float:
        """Frames per second: those of cameras as they came, if that is not what was said of them."""
        first, last = self._times
        if last <= first or abs((found := (self._frames - 1) / (last - first)) / self._fps - 1.0) < RATE_OFF:
            return float(self._fps)
        say(f"record={self._folder}: the cameras gave {found:.2f} pictures a second, not {self._fps:g}; so it is noted")
        return round(found, 3)

    def __exit__(self, *error: object) -> None:
        """Finish the videos, and make them a recording."""
        counts = [writer.finish() for writer in self._writers]
        if not self._frames or not min(counts):
            say(f"record={self._folder}: some camera gave no picture; no recording was made")
            return
        self._describe()
        say(f"record={self._folder}: {self._frames} frames; track them again with recording={self._folder}")

    def _describe(self) -> None:
        recording = self._recording
        save_calibration(CALIBRATION.of(self._folder), recording.rig)
        for place, pictures in ((BACKGROUND, recording.background), (OCCLUDERS, recording.occluders)):
            for path in pictures.values():
                place.of(self._folder).mkdir(exist_ok=True)
                shutil.copyfile(path, place.of(self._folder) / path.name)
        content: dict[str, Any] = {"up": recording.up, "fps": self._rate()}
        missing = {name: spans for name, spans in zip(recording.rig.names, self._missing, strict=True) if spans}
        if missing:
            content |= {"missing": missing, "fewest_cameras": 1}
        if recording.color_gains:
            content["color_gains"] = {name: [*gains] for name, gains in recording.color_gains.items()}
        write_file(SETTINGS.of(self._folder), yaml.safe_dump(content, sort_keys=False))


class _CameraVideo:
    """A camera's video, written by a thread of its own; at most so many pictures wait."""

    def __init__(self, path: Path, fps: float) -> None:
        self._path, self._fps, self._count = path, fps, 0
        self._items: deque[Picture | None] = deque()
        self._changed, self._ended = Condition(), False
        self._thread = Thread(target=self._run, name=f"video {path.stem}", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._path.parent.mkdir(parents=True, exist_ok=True)
        self._thread.start()

    def put(self, picture: Picture | None) -> bool:
        """Take a picture, or None where there is none; whether it will be in the video as it is."""
        with self._changed:
            behind = sum(item is not None for item in self._items)
            taken = picture if behind < PICTURES_BEHIND else None
            self._items.append(taken)
            self._changed.notify()
        return taken is not None

    def finish(self) -> int:
        """End the video; returns how many pictures it has."""
        with self._changed:
            self._ended = True
            self._changed.notify()
        self._thread.join()
        return self._count

    def _run(self) -> None:
        last, before = None, 0
        try:
            with VideoWriter(self._path, self._fps) as writer:
                while (item := self._next()) is not _END:
                    if item is None and last is None:
                        before += 1  # written once its size is known
                        continue
                    if item is not None:
                        last = np.asarray(item.bgr() if isinstance(item, YuvPicture) else item)
                    for _ in range(before + 1 if last is not None else 0):
                        writer.write(np.asarray(last))
                        self._count += 1
                    before = 0
                if not self._count:
                    raise InputError(f"{self._path}: the camera gave no picture")
        except (InputError, OSError) as error:
            self._count = 0
            say(f"record: {error}")
            while self._next() is not _END:
                pass

    def _next(self) -> object:
        with self._changed:
            while not self._items and not self._ended:
                self._changed.wait()
            return self._items.popleft() if self._items else _END


_END = object()
