"""The tracker as a pure object, for programs that go from frame to frame themselves."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import jax.numpy as jnp

from sogjax.api.tracking import actor_list, track_settings
from sogjax.energy.keypoints import keypoint_term_among
from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run import build
from sogjax.run.actors import Actors
from sogjax.run.clip import Clip
from sogjax.run.clip_keypoints import ClipKeypoints
from sogjax.run.passes import BEFORE_TRACKING
from sogjax.run.recordings import chosen_frames, with_cameras
from sogjax.run.run import Run
from sogjax.run.runner import run_passes
from sogjax.run.track import opened_clip
from sogjax.tracking.capacity import first_capacities
from sogjax.tracking.frame import AnyFrame, on_device
from sogjax.tracking.tracker import Tracker

ROOM = 2
"""Times the room that suits the first frame: nobody makes more while a pure step runs."""


def make_tracker(
    recording: Recording, actor: Body | Sequence[Body], *, terms: Sequence[Term] = (), **settings: Any
) -> Tracker:
    """The tracker of a recording as an immutable module (a pytree), with a pure step.

    Your own loop::

        tracker = sogjax.make_tracker(recording, actor)
        state, step = tracker.start(), equinox.filter_jit(tracker.step)
        for cells in sogjax.read_cells(recording, tracker):
            state, result = step(state, cells)

    `tracker.start()` is the state before the first frame, in the rough pose that the recording names or that is
    searched for; `tracker.start(pose)` in another one. A result has the `pose` (dof,) in radians and metres, the terms
    of the energy, and what the solver did. The step can be compiled and mapped like any function of jax.
    A frame that needs more room for image blobs than the tracker has, twice what its first frame needs, is an error.

    Args:
        recording: whose cameras and first frame the tracker is made for.
        actor: one, or a list of them, which become one body with their poses one after the other.
        terms: further terms of the energy, beside those of the settings.
        settings: as in `track_settings`; `start` is the frame of the initial pose; it and `every` are to be given to
            `read_cells` too.

    Raises:
        InputError: as `track`.
    """
    config, actors = track_settings(**settings), actor_list(actor)
    clip = opened_clip(with_cameras(recording, config.cameras), config)
    run = Run(clip, config, terms=terms, takes_steps=False, records={"actors": Actors(tuple(actors))})
    run_passes(run, BEFORE_TRACKING)
    tracker = replace(run.setup.tracker, initial_pose=jnp.asarray(run.initial_pose.pose))
    frame = on_device(next(clip.frames(run.initial_pose.frame, run.initial_pose.frame + 1)))
    return replace(tracker, capacities=first_capacities(tracker, tracker.start(), frame).times(ROOM))


def read_cells(
    recording: Recording, tracker: Tracker, start: int = 0, stop: int | None = None, every: int = 1
) -> Iterator[AnyFrame]:
    """What a tracker's step takes of each frame: the pictures of all cameras, averaged to cells (sRGB).

    Args:
        recording: with the cameras that the tracker was made for.
        tracker: which says how pictures are cut into cells.
        start: first frame, counted from the recording's first.
        stop: the frame before which to stop; None: the end.
        every: how many frames lie from one to the next.

    Returns:
        An iterator with the cells of each frame, as bytes; where a camera has no picture, or keypoints count, with
        these in a `FrameInput`.

    Raises:
        InputError: a picture cannot be read, another number of cameras, or no such frames.
    """
    grids = tracker.reader.candidates.grids
    if len(grids) != len(recording.rig.names):
        raise InputError(
            f"{recording.path}: the tracker was made for {len(grids)} cameras, this recording has "
            f"{len(recording.rig.names)}; open it with the same cameras"
        )
    pulled = keypoint_term_among(tracker.terms) is not None
    keypoints = ClipKeypoints.of_recording(recording) if pulled else None
    build.at_least("every", every, 1)
    clip = Clip(recording, chosen_frames(recording, start, stop, every), grids[0].depth, keypoints)
    return (frame.cells if frame[1:] == (None, None) else frame for frame in map(on_device, clip.frames()))
