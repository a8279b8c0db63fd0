"""Files that grow while a recording is tracked: motions, overlay video and Rerun file."""

import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from sogjax.errors import InputError, counted
from sogjax.io.array_log import read_log
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.motion import FRAMES_AT_ONCE, Motion, motion_from_poses
from sogjax.io.motion_log import MotionLog
from sogjax.io.recording import Recording
from sogjax.model.body import Body, dof_slices
from sogjax.model.color import to_rgb
from sogjax.model.limbs import limb_slices
from sogjax.run.clock import StageTimes
from sogjax.run.judged_frames import Judged
from sogjax.run.kept_run import KeptRun
from sogjax.run.pipeline import FrameDone, Picture, Preparation
from sogjax.run.terminal import say
from sogjax.scene.cells import CellGrid
from sogjax.settings.run import OutputsConfig

PARTIAL = ".partial"
"""Ending of the folder of an incomplete motion."""


def file_name(stem: str, ending: str, actor: str, num_actors: int) -> str:
    """`motion.npz`, or with several actors `motion_NAME.npz`."""
    return f"{stem}{ending}" if num_actors == 1 else f"{stem}_{actor}{ending}"


def partial_motions(folder: Path, bodies: Sequence[Body]) -> dict[str, Path]:
    """The folders of the incomplete motions, by actor."""
    return {body.name: folder / file_name("motion", PARTIAL, body.name, len(bodies)) for body in bodies}


def readable_frames(folder: Path, bodies: Sequence[Body]) -> int:
    """How many frames an earlier process wrote of every motion."""
    counts = []
    for path in partial_motions(folder, bodies).values():
        try:
            counts.append(len(read_log(path, mapped=True)["frame"]))
        except InputError:  # it was stopped before the first ones
            counts.append(0)
    return min(counts)


class Streams:
    """The growing files of a run, within a `with` block; only `consume` runs in another thread.

    If the block ends with an error, the motions stay beside their final names (`motion.partial`), readable by every
    command; overlay and Rerun file appear only when complete.

    Args:
        folder: of the results.
        recording: what is tracked.
        bodies: the actors, upright in the recording's world.
        first_frame: of the motion, in the recording's own numbering.
        wanted: which files.
        times: where the time of the stage `outputs` is noted.
        kept: where results are kept, so that another process can resume.
        num_kept: frames of the motion that an earlier process wrote.
    """

    def __init__(
        self,
        folder: Path,
        recording: Recording,
        bodies: Sequence[Body],
        first_frame: int,
        wanted: OutputsConfig,
        times: StageTimes,
        kept: KeptRun | None = None,
        num_kept: int = 0,
    ):
        self._recording, self._bodies, self._wanted, self.times = recording, bodies, wanted, times
        self._first_frame, self._first_new = first_frame, first_frame + num_kept
        self.num_skipped = 0 if wanted.overlay or wanted.rerun else num_kept
        """Frames at the beginning that can be skipped, since no output shows them."""
        self._next_frame = first_frame + self.num_skipped
        self._logs = {name: MotionLog(path, num_kept) for name, path in partial_motions(folder, bodies).items()}
        self._folder, self._kept = folder, kept
        self._stack = ExitStack()
        self._overlay: Any = None
        self._rerun: Any = None
        self.files: list[Path] = []
        """Files that are complete at the end of the block."""

    def __enter__(self) -> "Streams":
        for log in self._logs.values():
            self._stack.callback(log.close)
        if self._kept is not None:
            self._stack.callback(self._kept.close)
        if self._wanted.overlay:
            from sogjax.view.overlay_video import OverlayVideo

            self.files.append(self._folder / "overlay.mp4")
            video = OverlayVideo(self.files[-1], self._recording, width=self._wanted.overlay_width)
            self._overlay = self._stack.enter_context(video)
        if self._wanted.rerun:
            from sogjax.view.rerun.file import RerunFile

            self.files.append(self._folder / "motion.rrd")
            colors = [np.asarray(body.blob_colors, np.float32) for body in self._bodies]
            file = RerunFile(self.files[-1], self._recording, list(self._logs), blob_colors=colors)
            self._rerun = self._stack.enter_context(file)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        truth = self._recording.ground_truth
        if error is None and self._rerun is not None and truth is not None:
            self._rerun.write_markers(load_ground_truth(truth))
        self._stack.__exit__(kind, error, traceback)

    def preparation(self, grids: tuple[CellGrid, ...]) -> Preparation:
        """What must be kept of each picture."""
        makers = {}
        if self._overlay is not None:
            makers["tile"] = self._overlay.tile
        if self._rerun is not None and self._wanted.rerun_images:
            makers["jpeg"] = self._rerun.jpeg
        return Preparation(grids, **makers)

    def consume(self, frames: Iterator[FrameDone]) -> None:
        """Write the frames as they come, a few at a time."""
        while block := list(islice(frames, FRAMES_AT_ONCE)):
            begin = time.perf_counter()
            self._write(block)
            seconds = time.perf_counter() - begin
            for _ in block:
                self.times.add("outputs", seconds / len(block))

    def motions(self, mapped: bool) -> dict[str, Motion]:
        """The motions by actor; `mapped`: they stay on disk, until `end`."""
        return {name: log.motion(mapped) for name, log in self._logs.items()}

    def end(self, stays: bool = False) -> None:
        """Remove the growing motions once they have been written under their final names, unless all `stays`."""
        if stays:
            return
        for log in self._logs.values():
            log.remove()
        if self._kept is not None:
            self._kept.remove()

    def say_what_is_left(self) -> None:
        """After an error: print where the frames so far are, unless they go with the process."""
        if self._kept is not None and not self._kept.lasts:
            return
        if self._kept is not None and self._kept.is_settled:
            say("stopped when all frames were tracked; the same command with resume=true continues")
            return
        count = max(self._next_frame, self._first_new) - self._first_frame
        if not count or not all(log.folder.is_dir() for log in self._logs.values()):
            return
        folders = ", ".join(str(log.folder) for log in self._logs.values())
        remedy = "" if self._kept is None else "; the same command with resume=true continues"
        say(f"stopped after {counted(count, 'frame')}; their motion is in {folders}{remedy}")

    def _write(self, block: list[FrameDone]) -> None:
        motions = self._motions(block)
        if self._next_frame >= self._first_new:
            for name, motion in motions.items():
                self._logs[name].append(motion)
            if self._kept is not None:
                self._kept.append([done.tracked for done in block])
        first, self._next_frame = self._next_frame, self._next_frame + len(block)
        shown = list(motions.values())
        if self._overlay is not None:
            self._overlay.write(shown, ([picture.tile for picture in done.pictures] for done in block))
        if self._rerun is not None:
            self._write_rerun(block, shown, first)

    def _motions(self, block: list[FrameDone]) -> dict[str, Motion]:
        """One motion per actor; similarity, energy and iterations are those of all actors together."""
        results = [done.tracked.result for done in block]
        poses = np.stack([np.asarray(result.pose) for result in results])
        judgements = [result.limbs for result in results if result.limbs is not None]
        judged = Judged.of(judgements, self._recording.rig.names) if judgements else None
        return {
            body.name: motion_from_poses(
                body,
                poses[:, part],
                self._recording.fps,
                frame=self._next_frame + np.arange(len(block)),
                similarity=np.array([result.terms["similarity"] for result in results], float),
                energy=np.array([result.energy for result in results], float),
                iterations=np.array([result.iterations for result in results], int),
                converged=np.array([result.converged for result in results], bool),
                up=self._recording.up,
                **({} if judged is None else judged.of_actor(actor, body, limbs)),
            )
            for actor, (body, part, limbs) in enumerate(
                zip(self._bodies, dof_slices(self._bodies), limb_slices(self._bodies), strict=True)
            )
        }

    def _write_rerun(self, block: list[FrameDone], motions: list[Motion], first: int) -> None:
        terms = [done.tracked.result.terms for done in block]
        others = {name: np.array([t[name] for t in terms], float) for name in terms[0] if name != "similarity"}
        self._rerun.write(motions, others)
        for frame, done in enumerate(block, first):
            self._rerun.write_pictures(frame, _jpegs(done.pictures), image_blobs(done))


def _jpegs(pictures: list[Picture]) -> list[Any]:
    return [picture.jpeg for picture in pictures]


_to_rgb = jax.jit(to_rgb, static_argnums=1)


def image_blobs(done: FrameDone) -> list[Any]:
    """The image blobs that a frame used, by camera, in sRGB."""
    from sogjax.view.rerun.file import ImageBlobs

    images = done.tracked.result.images
    rgb = _to_rgb(jnp.asarray(images.colors), done.tracked.color_space)
    masks, means, sigmas, rgb = jax.device_get((images.mask, images.means, images.sigmas, rgb))
    return [ImageBlobs(means[c][mask], sigmas[c][mask], rgb[c][mask]) for c, mask in enumerate(masks)]
