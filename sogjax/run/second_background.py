"""A background that is learnt a second time, once the subject was tracked: where its body is, no sample counts.

Somebody who stays in one place hides what is around: a trunk that never moves and a wall look alike, so nothing around
it counts as background at first. When the body was followed, it does.
"""

from collections.abc import Mapping, Sequence

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.background import clip_backgrounds_without
from sogjax.run.backwards import frames_backwards, tracked_backwards
from sogjax.run.clip_learning import LeftOut, sampled_frames
from sogjax.run.clock import StageTimes
from sogjax.run.job import Job
from sogjax.run.kept_run import KeptRun
from sogjax.run.pipeline import PictureReader, Preparation, frame_input
from sogjax.run.terminal import progress, say
from sogjax.scene.background import stack_background
from sogjax.scene.cells import CellGrid
from sogjax.scene.clip_background import FEWEST_AGREEING
from sogjax.scene.foreground import BackgroundModel
from sogjax.scene.plate_difference import working_size
from sogjax.search.search_energy import DISC
from sogjax.settings.method import ImagesConfig
from sogjax.tracking.frame_by_frame import track
from sogjax.tracking.tracker import Tracker
from sogjax.view.projection import picture_points

MUCH_UNKNOWN = 0.015
"""Share of the pictures from which on the background is learnt again; a subject covers some 0.05 of them."""
BORDER = 0.15
"""Metres around a blob that are left out, too: the body may be a little off. With 0.25 too little is left to learn."""


def learnt_again(
    job: Job,
    images: ImagesConfig,
    read: PictureReader,
    poses: Mapping[int, Array] | None = None,
    kept: KeptRun | None = None,
) -> Tracker:
    """The job's tracker, with a background that was learnt again where the first one left much open.

    Args:
        job: whose tracker.
        images: says how pictures are read backwards.
        read: reads pictures.
        poses: of the frames, counted from the recording's first, if they are known; None: they are tracked.
        kept: where those that were tracked for this are kept, so that another process need not track them again.

    Raises:
        InputError: a video cannot be read, or a picture has too many image blobs.
    """
    unknown = unknown_share(job.tracker, job.recording, job.grids, images)
    first, stop = job.frames
    samples = [frame for frame in sampled_frames(job.recording) if first <= frame < stop]
    if unknown < MUCH_UNKNOWN or len(samples) < FEWEST_AGREEING:  # of a short part too little would be learnt
        return job.tracker
    if poses is None and kept is not None:
        poses = kept.sampled()
    if poses is None:
        say(
            f"{unknown:.1%} of the background is unknown: the clip is tracked once to learn it where the body is not, "
            "then again"
        )
        poses = _first_pass(job, images, read)
        if kept is not None:
            kept.keep_sampled(poses)
    return knowing_the_body(job.tracker, job.recording, job.grids, poses)


def unknown_share(tracker: Tracker, recording: Recording, grids: Sequence[CellGrid], images: ImagesConfig) -> float:
    """How much of the pictures a background that was learnt from the clip leaves open; 0 without such a one."""
    empty = tracker.reader.background
    if empty is None or _from_pictures(recording, images):
        return 0.0
    inside = np.zeros(np.asarray(empty.known).shape, bool)
    for k, grid in enumerate(grids):
        inside[k, : grid.rows, : grid.columns] = True
    return 1.0 - float(np.asarray(empty.known)[inside].mean())


def knowing_the_body(
    tracker: Tracker, recording: Recording, grids: Sequence[CellGrid], poses: Mapping[int, Array]
) -> Tracker:
    """The tracker with a background that is learnt where the body is not; elsewhere it is what it was.

    Args:
        tracker: with a background learnt from the clip.
        recording: with the cameras.
        grids: of their pictures.
        poses: that the tracker found, by frame, counted from the recording's first.

    Raises:
        InputError: a video cannot be read.
    """
    learnt = clip_backgrounds_without(recording, body_masks(recording, tracker.body, poses))
    again, before = BackgroundModel.from_background(stack_background(learnt, grids)), tracker.reader.background
    assert before is not None
    return eqx.tree_at(lambda t: t.reader.background, tracker, again.filled_by(before))


def body_masks(recording: Recording, body: Body, poses: Mapping[int, Array]) -> LeftOut:
    """Where a body is in the sampled frames, widened; a frame whose pose is not known is left out as a whole.

    Args:
        recording: with the cameras.
        body: upright in the recording's world.
        poses: by frame, counted from the recording's first.
    """
    frames = sampled_frames(recording)
    known = [frame for frame in frames if frame in poses]
    blobs = eqx.filter_jit(lambda body, pose: body.posed_blobs(pose))
    means = np.stack([np.asarray(blobs(body, jnp.asarray(poses[frame])).means, float) for frame in known])
    pixels, depths = picture_points(recording.rig, means)
    radii = DISC * np.asarray(body.blob_sigmas, float) + BORDER
    masks: dict[str, dict[int, Bool[np.ndarray, "rows columns"]]] = {}
    for k, name in enumerate(recording.rig.names):
        width, height = working_size(*recording.rig.image_size(name))
        focal = float(recording.rig.camera(name).focal_length)
        scale = width / recording.rig.image_size(name)[0]
        masks[name] = {frame: np.ones((height, width), bool) for frame in frames if frame not in poses}
        for at, frame in enumerate(known):
            sizes = radii * focal / np.maximum(depths[k, at], 0.1)
            masks[name][frame] = _discs((height, width), scale * pixels[k, at], scale * sizes)
    return masks


def _discs(
    shape: tuple[int, int], centres: Float[np.ndarray, "blob 2"], radii: Float[np.ndarray, "blob"]
) -> Bool[np.ndarray, "rows columns"]:
    mask = np.zeros(shape, np.uint8)
    for centre, radius in zip(centres, radii, strict=True):
        if np.isfinite(centre).all():
            cv2.circle(mask, (round(float(centre[0])), round(float(centre[1]))), round(float(radius)), 1, -1)
    return mask > 0


def _from_pictures(recording: Recording, images: ImagesConfig) -> bool:
    """Whether the background was photographed."""
    photographed = all(name in recording.background for name in recording.rig.names)
    return images.background == "pictures" or (images.background == "auto" and photographed)


def _first_pass(job: Job, images: ImagesConfig, read: PictureReader) -> dict[int, Array]:
    """The poses of the sampled frames, by frame; the others are tracked, but not held in memory."""
    sampled, poses = {*sampled_frames(job.recording)}, dict[int, Array]()
    if job.begin > job.frames[0]:
        frames = frames_backwards(job.recording, job.grids, images, job.frames[0], job.begin + 1)
        known = job.with_keypoints(frames, range(job.begin, job.frames[0] - 1, -1))
        prefix = tracked_backwards(job.tracker, job.start, known, job.begin + 1 - job.frames[0], StageTimes())
        frame_of = range(job.frames[0], job.frames[0] + prefix.num_frames)
        poses = {frame: prefix.pose(k) for k, frame in enumerate(frame_of) if frame in sampled}
    pictures = read(job.recording, Preparation(job.grids), job.begin, job.frames[1])
    cells = (frame_input([picture.cells for picture in frame]) for frame in pictures)
    shown = progress(cells, job.frames[1] - job.begin, "tracking, to learn the background")
    for done in track(job.tracker, job.start, job.with_keypoints(shown, range(job.begin, job.frames[1]))):
        if job.begin + done.index in sampled:
            poses[job.begin + done.index] = jnp.asarray(done.result.pose)
    return poses
