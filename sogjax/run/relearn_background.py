"""A background that is learnt a second time, once the subject was tracked: where its body is, no sample counts.

Somebody who stays in one place hides what is around: a trunk that never moves and a wall look alike, so nothing around
it counts as background at first. When the body was followed, it does. And somebody who walks towards a camera is seen
in one place for most of the clip, and becomes background there, though the other cameras see him well.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt8

from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.background import MUCH_UNKNOWN, Background
from sogjax.run.clip_learning import LeftOut, UnsuitableError, background_samples, learnt_from
from sogjax.run.initial_pose import InitialPose
from sogjax.run.setup import Setup
from sogjax.run.taken_bodies import cameras_that_took_bodies
from sogjax.run.terminal import progress, say
from sogjax.scene.background import BackgroundImage
from sogjax.scene.background_difference import channel_max, working_size
from sogjax.scene.clip_background import FEWEST_AGREEING
from sogjax.search.search_energy import DISC
from sogjax.tracking.frame_by_frame import track
from sogjax.view.projection import picture_points

FOLDER, FIRST = "relearnt", "first"
BORDER = 0.15
"""Metres around a blob that are left out, too: the body may be a little off. With 0.25 too little is left to learn."""

SAME = 16
"""Grey levels, of the channel that differs most: within, what the first background shows is what the body showed."""
STAYS, MOSTLY = 0.5, 0.6
"""Parts of the samples in which the body covers a pixel, and of these in which the first background shows the same:
then the body was taken for background. Who passes by uncovers enough."""


@dataclass(frozen=True)
class RelearntBackground:
    """What was learnt where the body is not; None: the first background does."""

    background: Background | None
    first: Background | None = None
    """The first background without what turned out to be the body; it holds where nothing was learnt."""

    @property
    def whole(self) -> Background | None:
        """What is known of the empty scene by now, and of furniture from the first; None: no more than before."""
        if self.background is None or self.first is None:
            return None
        pairs = zip(self.background.required(), self.first.required(), strict=True)
        return Background(tuple(again.filled(before).calm_as(before) for again, before in pairs))

    def in_setup(self, setup: Setup) -> Setup:
        """The setup with this background where something is known of it, and with its own elsewhere."""
        if self.background is None:
            return setup
        again, before = (found and found.model(setup.clip.grids) for found in (self.background, self.first))
        assert again is not None
        assert before is not None
        tracker = eqx.tree_at(lambda t: t.reader.background, setup.tracker, again.filled_by(before))
        return replace(setup, tracker=tracker)

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder."""
        (self.background or Background(None)).save(folder / FOLDER)
        (self.first or Background(None)).save(folder / FIRST)

    @classmethod
    def load(cls, folder: Path) -> "RelearntBackground | None":
        """What was kept, if it was."""
        kept, first = (Background.load(folder / name) for name in (FOLDER, FIRST))
        if kept is None or first is None:
            return None
        return cls(*(found if found.cameras else None for found in (kept, first)))


def relearn_background(
    setup: Setup,
    background: Background,
    start: InitialPose,
    known: Mapping[int, Float[np.ndarray, "dof"]],
    poses: Mapping[int, Array] | None = None,
) -> RelearntBackground:
    """The background once more where the first one left much open or took the body, with poses of sampled frames known.

    Args:
        setup: what is tracked with.
        background: the first one.
        start: where tracking begins.
        known: the poses of other frames that are known, by frame.
        poses: those of the frames that are tracked, by frame; None: the clip is tracked for them.

    Raises:
        InputError: a video cannot be read, the clip is unsuitable, or a picture has too many image blobs.
    """
    told = {frame: pose for frame, pose in known.items() if frame in setup.clip.numbers}
    reason = why_learn_again(setup, background, told | {start.frame: start.pose})
    samples = reason and frames_to_learn_from(background_samples(setup.clip.recording).frames, setup.clip.numbers)
    if not samples:
        return RelearntBackground(None)
    body, firsts = setup.tracker.body, background.required()
    shown = setup.clip.sampled([background_samples(setup.clip.recording)])[0]
    if poses is None:
        say(f"{reason}: the clip is tracked once to learn the background where the body is not, then again")
        there = _at_samples(told | {start.frame: start.pose}, samples)
        masks = body_masks(setup.clip.recording, body, there, border=0.0)
        open_there = [without_body(*of_camera, 1) for of_camera in zip(firsts, shown, masks.values(), strict=True)]
        poses = _tracked_poses(_with_background(setup, Background(tuple(open_there))), start, frozenset(samples))
    try:
        learnt = learnt_from(setup.clip, body_masks(setup.clip.recording, body, poses))
    except UnsuitableError as reason:
        raise InputError(f"{setup.clip.recording.path}: no background can be learnt, since {reason}") from reason
    masks = body_masks(setup.clip.recording, body, poses, border=0.0)
    without = [
        without_body(*of_camera, max(FEWEST_AGREEING, int(np.ceil(STAYS * len(of_camera[1])))))
        for of_camera in zip(firsts, shown, masks.values(), strict=True)
    ]
    again = [first if first.origin == "picture" else one for first, one in zip(firsts, learnt, strict=True)]
    return RelearntBackground(Background(tuple(again)), Background(tuple(without)))


def without_body(
    first: BackgroundImage,
    shown: Mapping[int, UInt8[np.ndarray, "rows columns 3"]],
    covered: Mapping[int, Bool[np.ndarray, "rows columns"]],
    fewest: int,
) -> BackgroundImage:
    """A learnt background that knows nothing where it shows what the body did that stood there.

    Args:
        first: of one camera.
        shown: what it showed, by frame.
        covered: where the body was, by frame.
        fewest: frames in which the body must have been there.
    """
    if first.origin != "clip":
        return first
    count, same = np.zeros(first.known.shape, np.uint16), np.zeros(first.known.shape, np.uint16)
    for frame in shown.keys() & covered.keys():
        if not covered[frame].all():
            count += covered[frame]
            same += covered[frame] & (channel_max(cv2.absdiff(first.picture, np.asarray(shown[frame]))) <= SAME)
    taken = (count >= fewest) & (same >= MOSTLY * count)
    return replace(first, known=first.known & ~taken)


def _at_samples(
    known: Mapping[int, Float[np.ndarray, "dof"]], samples: Sequence[int]
) -> dict[int, Float[np.ndarray, "dof"]]:
    """Known poses by the sampled frames that are nearest to theirs: legs that stand there are there as well."""
    nearest = lambda frame: min(samples, key=lambda sample: abs(sample - frame))
    return {nearest(frame): pose for frame, pose in known.items()}


def _with_background(setup: Setup, background: Background) -> Setup:
    tracker = eqx.tree_at(lambda t: t.reader.background, setup.tracker, background.model(setup.clip.grids))
    return replace(setup, tracker=tracker)


def frames_to_learn_from(samples: Sequence[int], numbers: range) -> list[int]:
    """The sampled frames that are tracked; none where few of them are.

    Where frames between those to track are left out, it is said how many samples are.
    """
    spanned = [frame for frame in samples if numbers[0] <= frame <= numbers[-1]]
    found = [frame for frame in spanned if frame in numbers]
    if len(found) < len(spanned):
        say(f"of {len(spanned)} frames to learn the background from, {len(found)} are tracked; the others do not count")
    return found if len(found) >= FEWEST_AGREEING else []


def why_learn_again(setup: Setup, background: Background, known: Mapping[int, Float[np.ndarray, "dof"]]) -> str | None:
    """What speaks for learning a background again; None: nothing does. Poses are `known` of some frames."""
    if not background.is_learnt:
        return None
    unknown = unknown_share(setup)
    if unknown >= MUCH_UNKNOWN:
        return f"{unknown:.1%} of the background is unknown"
    taken = cameras_that_took_bodies(setup, background.required(), known)
    return f"{' and '.join(taken)} took the body for background" if taken else None


def unknown_share(setup: Setup) -> float:
    """How much of the pictures a background that was learnt from the clip leaves open."""
    model = setup.tracker.reader.background
    if model is None:
        return 0.0
    inside = np.zeros(np.asarray(model.known).shape, bool)
    for k, grid in enumerate(setup.clip.grids):
        inside[k, : grid.rows, : grid.columns] = True
    return 1.0 - float(np.asarray(model.known)[inside].mean())


def _tracked_poses(setup: Setup, start: InitialPose, wanted: frozenset[int]) -> dict[int, Array]:
    """The poses of some frames, by frame; the others are tracked, but not held in memory."""
    numbers, poses = setup.clip.numbers, dict[int, Array]()
    begin = numbers.index(start.frame)
    for way, label in ((numbers[begin::-1], "tracking back"), (numbers[begin:], "tracking")):
        if len(way) > 1 or way.step > 0:
            frames = progress(
                setup.clip.frames(way.start, way.stop, way.step), len(way), f"{label}, to learn the background"
            )
            for frame, done in zip(way, track(setup.tracker, jnp.asarray(start.pose), frames), strict=True):
                if frame in wanted:
                    poses[frame] = jnp.asarray(done.result.pose)
    return poses


def body_masks(
    recording: Recording, body: Body, poses: Mapping[int, Array] | Mapping[int, np.ndarray], border: float = BORDER
) -> LeftOut:
    """Where a body is in the sampled frames, widened; a frame whose pose is not known is left out as a whole.

    Args:
        recording: with the cameras.
        body: upright in the recording's world.
        poses: by frame.
        border: metres by which it is widened.
    """
    frames = background_samples(recording).frames
    known = [frame for frame in frames if frame in poses]
    blobs = eqx.filter_jit(lambda body, pose: body.posed_blobs(pose))
    means = np.stack([np.asarray(blobs(body, jnp.asarray(poses[frame])).means, float) for frame in known])
    pixels, depths = picture_points(recording.rig, means)
    radii = DISC * np.asarray(body.blob_sigmas, float) + border
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
