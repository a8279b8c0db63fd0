"""The tracker as a pure object, for programs that go from frame to frame themselves."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from sogjax.api.tracking import actor_list, track_settings
from sogjax.energy.keypoints import keypoint_term_among
from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run.cells import picture_reader
from sogjax.run.clip_keypoints import ClipKeypoints, with_keypoints
from sogjax.run.job import Job
from sogjax.run.keypoint_offsets import told_offsets
from sogjax.run.pipeline import Preparation, frame_input, read_pictures
from sogjax.run.recordings import with_cameras
from sogjax.tracking.capacity import first_capacities
from sogjax.tracking.culling import Capacities, capacity_for
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
        settings: as in `track_settings`; `start` is the frame of the first pose, and to be given to `read_cells` too.

    Raises:
        InputError: as `track`.
    """
    config, actors = track_settings(**settings), actor_list(actor)
    recording = with_cameras(recording, config.cameras)
    job = Job.from_config(recording, actors, config, terms=terms)
    tracker = replace(told_offsets(job, picture_reader(config.images)), first_pose=job.start)
    frame = on_device(next(read_cells(recording, tracker, job.frames[0], job.frames[0] + 1)))
    return replace(tracker, capacities=_with_more_room(first_capacities(tracker, tracker.start(), frame)))


def read_cells(recording: Recording, tracker: Tracker, start: int = 0, stop: int | None = None) -> Iterator[AnyFrame]:
    """What a tracker's step takes of each frame: the pictures of all cameras, averaged to cells (sRGB).

    Args:
        recording: with the cameras that the tracker was made for.
        tracker: which says how pictures are cut into cells.
        start: first frame, counted from the recording's first.
        stop: the frame before which to stop; None: the end.

    Returns:
        An iterator with the cells of each frame, as bytes; where a camera has no picture, or keypoints count, with
        these in a `FrameInput`.

    Raises:
        InputError: a picture cannot be read, another number of cameras, or no such frames.
    """
    grids = tracker.reader.candidates.grids
    last = recording.num_frames if stop is None else stop
    if len(grids) != len(recording.rig.names):
        raise InputError(
            f"{recording.path}: the tracker was made for {len(grids)} cameras, this recording has "
            f"{len(recording.rig.names)}; open it with the same cameras"
        )
    if not 0 <= start < last <= recording.num_frames:
        raise InputError(
            f"start={start} stop={stop}: {recording.path} has the frames 0 to {recording.num_frames - 1}; choose "
            f"0 <= start < stop <= {recording.num_frames}"
        )
    pictures = read_pictures(recording, Preparation(grids), start, last)
    frames = (on_device(frame_input([picture.cells for picture in shown])) for shown in pictures)
    pulled = keypoint_term_among(tracker.terms) is not None
    keypoints = ClipKeypoints.of_recording(recording) if pulled else None
    known = with_keypoints(keypoints, frames, range(start, last))
    return (frame.cells if frame[1:] == (None, None) else frame for frame in known)


def _with_more_room(first: Capacities) -> Capacities:
    return Capacities(capacity_for(ROOM * first.near), capacity_for(ROOM * first.matching), ROOM * first.blocks)
