"""Files that show frames and grow with them: overlay video and Rerun file."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.frame_table import FrameTable
from sogjax.io.ground_truth import load_ground_truth
from sogjax.model.body import Body
from sogjax.model.color import to_rgb
from sogjax.run.clip import Clip
from sogjax.run.run_files import OVERLAY, RERUN
from sogjax.settings.run import OutputsConfig
from sogjax.tracking.frame import TrackedFrame


class ResultStreams:
    """The growing files of a run, within a `with` block; after an error none of them is there.

    Args:
        folder: of the results.
        clip: what is tracked.
        bodies: the actors, upright in the recording's world.
        wanted: which files.
    """

    def __init__(self, folder: Path, clip: Clip, bodies: Sequence[Body], wanted: OutputsConfig):
        self._folder, self._clip, self._bodies, self._wanted = folder, clip, bodies, wanted
        self._facts = ClipFacts.of(clip.recording)
        self._stack = ExitStack()
        self._overlay: Any = None
        self._rerun: Any = None
        self.files: list[Path] = []
        """The files that are complete at the end of the block."""

    @property
    def show_frames(self) -> bool:
        """Whether any of them shows frames."""
        return self._wanted.overlay or self._wanted.rerun

    @property
    def show_blobs(self) -> bool:
        """Whether they show image blobs."""
        return self._wanted.rerun

    def __enter__(self) -> "ResultStreams":
        recording = self._clip.recording
        if self._wanted.overlay:
            from sogjax.view.overlay import OverlayVideo

            self.files.append(OVERLAY.of(self._folder))
            video = OverlayVideo(self.files[-1], recording, self._clip.fps, self._wanted.overlay_width)
            self._overlay = self._stack.enter_context(video)
        if self._wanted.rerun:
            from sogjax.view.rerun.file import RerunFile

            self.files.append(RERUN.of(self._folder))
            colors = [np.asarray(body.blob_colors, np.float32) for body in self._bodies]
            names = [body.name for body in self._bodies]
            self._rerun = self._stack.enter_context(RerunFile(self.files[-1], recording, names, blob_colors=colors))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        truth = self._clip.recording.ground_truth
        if error is None and self._rerun is not None and truth is not None:
            self._rerun.write_markers(load_ground_truth(truth))
        self._stack.__exit__(kind, error, traceback)

    def picture_maker(self) -> Callable[[int, int, np.ndarray], tuple[Any, Any]] | None:
        """What must be kept of each picture, a tile and a JPEG; None: nothing."""
        tile = self._overlay.tile if self._overlay is not None else lambda camera, image: None
        jpeg = lambda camera, image: None
        if self._rerun is not None and self._wanted.rerun_images:
            jpeg = self._rerun.jpeg
        elif self._overlay is None:
            return None
        return lambda camera, frame, image: (tile(camera, image), jpeg(camera, image))

    def write(self, rows: FrameTable, frames: Sequence[TrackedFrame], pictures: Sequence[Sequence[Any]]) -> None:
        """Append frames, as their rows have them, with what was made of their pictures."""
        if self._overlay is None and self._rerun is None:
            return
        motions = [*motions_of(rows, self._bodies, self._facts).values()]
        parts = lambda shown, part: [None if picture is None else picture[part] for picture in shown]
        if self._overlay is not None:
            self._overlay.write(motions, (parts(shown, 0) for shown in pictures))
        if self._rerun is not None:
            self._rerun.write(motions, {name: values for name, values in rows.terms.items() if name != "similarity"})
            for number, frame, shown in zip(rows.frame.tolist(), frames, pictures, strict=True):
                self._rerun.write_pictures(number, parts(shown, 1), image_blobs_of(frame))


_to_rgb = jax.jit(to_rgb, static_argnums=1)


def image_blobs_of(frame: TrackedFrame) -> list[Any]:
    """The image blobs that a frame used, by camera, in sRGB."""
    from sogjax.view.rerun.file import ImageBlobs

    images = frame.result.images
    rgb = _to_rgb(jnp.asarray(images.colors), frame.color_space)
    masks, means, sigmas, rgb = jax.device_get((images.mask, images.means, images.sigmas, rgb))
    return [ImageBlobs(means[c][mask], sigmas[c][mask], rgb[c][mask]) for c, mask in enumerate(masks)]
