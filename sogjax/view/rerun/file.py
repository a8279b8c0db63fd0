"""A tracked recording, with all that is known of it, in one Rerun file."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

import numpy as np
import rerun as rr
from jaxtyping import Float

from sogjax.io.ground_truth import GroundTruth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.view.bones import Bones, actor_palette, blob_palette, bones_from_motion
from sogjax.view.projection import frame_range
from sogjax.view.rerun.curves import log_curve_looks, log_curves, own_curves, plots_with
from sogjax.view.rerun.layout import tracking_layout
from sogjax.view.rerun.scene import Scene, log_body, log_doubts, log_look
from sogjax.view.rerun.stream import actor_entity, camera_entity, rerun_stream


class ImageBlobs(NamedTuple):
    """The blobs of one picture: undistorted pixels of the picture as recorded, sRGB in 0..1."""

    means: np.ndarray
    sigmas: np.ndarray
    colors: np.ndarray


def write_rerun(
    path: Path,
    recording: Recording,
    motions: Sequence[Motion],
    *,
    names: Sequence[str] | None = None,
    frames: Iterable[Sequence[np.ndarray | None]] | None = None,
    truth: GroundTruth | None = None,
    progress: Callable[[Iterable[int], int, str], Iterable[int]] = lambda items, count, title: items,
) -> None:
    """Write cameras, pictures, bodies, markers and curves, with a layout that opens well.

    Pictures are made smaller and freed of their lens distortion, so that everything in them lies as in 3-D.

    Args:
        path: the `.rrd` file, replaced as a whole.
        recording: what was tracked.
        motions: one for each actor.
        names: the actors' names; default `actor`, `actor_2`, ...
        frames: BGR pictures of all cameras, from the motions' first frame to their last; None: no pictures.
        truth: markers to show beside the bodies.
        progress: wraps the frames' numbers to show progress: (numbers, count, title).
    """
    names = list(names) if names else ["actor", *(f"actor_{k + 2}" for k in range(len(motions) - 1))][: len(motions)]
    first, stop = frame_range(recording, motions)
    with RerunFile(path, recording, names) as file:
        file.write(motions, {})
        if frames is not None:
            for frame, pictures in zip(progress(range(first, stop), stop - first, "Rerun file"), frames, strict=False):
                file.write_pictures(frame, [file.jpeg(k, image) for k, image in enumerate(pictures)], ())
        file.write_markers(truth)


class RerunFile:
    """A Rerun file that is written as the motion comes, within a `with` block; it gets its name when it is complete.

    Args:
        path: the `.rrd` file, replaced as a whole.
        recording: what is tracked.
        names: the actors' names.
        blob_colors: sRGB in 0..1 of each actor's blobs; default by the side of the body.
        picture_width: largest width of the stored pictures in pixels.
    """

    def __init__(
        self,
        path: Path,
        recording: Recording,
        names: Sequence[str],
        *,
        blob_colors: Sequence[Float[np.ndarray, "_ 3"]] | None = None,
        picture_width: int = 640,
    ) -> None:
        self._path, self._recording, self._names = path, recording, list(names)
        self._picture_width, self._colors = picture_width, blob_colors
        self._bones: list[Bones] = []
        self._paths: list[list[np.ndarray]] = [[] for _ in names]
        self._frames: tuple[int, int] | None = None
        self._with_blobs = False
        self._plots: dict[str, str] = {}

    def __enter__(self) -> "RerunFile":
        self._files = ExitStack()
        self._stream = self._files.enter_context(rerun_stream(self._path, self._recording.name))
        self._scene = Scene(self._stream, self._recording, self._picture_width)
        return self

    def jpeg(self, camera: int, image: np.ndarray | None) -> bytes | None:
        """A camera's picture (BGR) as it is stored; thread-safe."""
        return None if image is None else self._scene.cameras[camera].jpeg(image)

    def write(self, motions: Sequence[Motion], terms: Mapping[str, Float[np.ndarray, "frame"]]) -> None:
        """Write the bodies and curves of the frames that follow.

        Args:
            motions: one for each actor.
            terms: further curves by name, over the first motion's frames.
        """
        if not self._bones:
            self._begin(motions, terms)
        for k, (name, motion) in enumerate(zip(self._names, motions, strict=True)):
            bones, entity = self._bones[k], actor_entity(name)
            log_body(self._stream, entity, motion, bones)
            log_doubts(self._stream, entity, motion, bones)
            log_curves(self._stream, motion, self._curve_actor(name), own_curves(motion))
            self._paths[k].append(bones.points(motion)[:, 0] if bones.num_joints else motion.blob_means.mean(axis=1))
            self._scene.extend(motion.blob_means)
        log_curves(self._stream, motions[0], None, terms)
        first, stop = frame_range(self._recording, motions)
        self._frames = (first if self._frames is None else min(first, self._frames[0]), stop)

    def write_pictures(
        self, frame: int, jpegs: Sequence[bytes | None], image_blobs: Sequence[ImageBlobs | None]
    ) -> None:
        """Write the pictures of all cameras, as `jpeg` makes them, and their blobs; either may be empty."""
        self._with_blobs |= len(image_blobs) > 0
        self._scene.set_frame(frame)
        self._scene.log_pictures(jpegs)
        for camera, sog in zip(self._scene.cameras, image_blobs, strict=False):
            if sog is not None:
                radii = np.asarray(sog.sigmas) * float(np.sqrt(camera.scale.prod()))
                pixels = camera.pixels(np.asarray(sog.means))
                points = rr.Points2D(pixels, radii=radii, colors=_color_bytes(sog.colors))
                self._stream.log(f"{camera_entity(camera.name)}/blobs", points)
        self._stream.reset_time()

    def write_markers(self, truth: GroundTruth | None) -> None:
        """Write true markers beside the bodies, over the frames that were written."""
        self._scene.log_markers(truth, *(self._frames or (0, 0)))

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Write what is known only at the end, or remove the file after an error.

        Raises:
            InputError: the file could not be written.
        """
        if error is not None:
            self._files.__exit__(kind, error, traceback)
            return
        with self._files:
            if self._bones:
                self._end()

    def _begin(self, motions: Sequence[Motion], terms: Mapping[str, np.ndarray]) -> None:
        """Write what is written once per file: the looks of bodies and curves."""
        self._bones = [bones_from_motion(motion) for motion in motions]
        self._plots = plots_with([*own_curves(motions[0]), *terms])
        for k, (name, motion) in enumerate(zip(self._names, motions, strict=True)):
            colors = blob_palette(motion, k) if self._colors is None else _color_bytes(self._colors[k])
            log_look(self._stream, actor_entity(name), motion, self._bones[k], k, colors)
            log_curve_looks(self._stream, self._curve_actor(name), own_curves(motion), 3 * k)
        log_curve_looks(self._stream, None, terms, 3 * len(motions))

    def _end(self) -> None:
        """Write what needs the whole motion: how cameras are shown, the roots' paths, the layout."""
        self._scene.log_cameras()
        for k, name in enumerate(self._names):
            path = rr.LineStrips3D([np.concatenate(self._paths[k])], colors=[actor_palette(k)[1]], radii=[0.004])
            self._stream.log(f"{actor_entity(name)}/path", path, static=True)
        layout = tracking_layout(self._recording, self._names, self._with_blobs, self._plots, self._scene.eye())
        self._stream.send_blueprint(layout)

    def _curve_actor(self, name: str) -> str | None:
        return name if len(self._names) > 1 else None


def _color_bytes(colors: np.ndarray) -> np.ndarray:
    """Colours in 0..1 as bytes."""
    return np.rint(255.0 * np.clip(np.asarray(colors), 0.0, 1.0)).astype(np.uint8)
