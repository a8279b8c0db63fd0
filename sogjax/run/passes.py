"""The machine: the passes of a run in their order. Each reads what earlier ones found, and leaves one record."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from sogjax.errors import InputError, counted
from sogjax.io.frame_motions import FRAMES, ClipFacts
from sogjax.io.frame_table import FrameLog
from sogjax.run.actors import Actors
from sogjax.run.adjust_clip import Adjusted, adjust_clip
from sogjax.run.background import Background, learn_background, said_if_none
from sogjax.run.clock import (
    ACTORS,
    ADJUSTING,
    BACKGROUND,
    BOTH_WAYS,
    FILTERING,
    INITIAL_POSE,
    PREPARING,
    TRACKING,
    WRITING,
)
from sogjax.run.filter import Filtered, filter_frames
from sogjax.run.forward import Tracked, kept_rows, track_forward
from sogjax.run.initial_pose import (
    FROM_FILE,
    SOURCES,
    InitialPose,
    compile_sources,
    find_initial_pose,
    say_who_is_elsewhere,
)
from sogjax.run.judge import judged_result
from sogjax.run.kept_actors import kept_or_made
from sogjax.run.keypoint_bias import KeypointBias, estimate_keypoint_bias
from sogjax.run.learn_occluders import LearntOccluders, Retracked, learn_occluders, track_again
from sogjax.run.merge import Merged, merge_backward
from sogjax.run.recolor_actors import RecoloredActors, recolor_actors
from sogjax.run.relearn_background import RelearntBackground, relearn_background
from sogjax.run.remake_actors import RemadeActors, remake_actors
from sogjax.run.result_streams import ResultStreams
from sogjax.run.run import Run
from sogjax.run.run_files import GUESS
from sogjax.run.setup import compile_beforehand
from sogjax.run.terminal import say
from sogjax.run.write import check_formats, check_pose2sim, write_results
from sogjax.search.limb_search import compile_search
from sogjax.tracking.frame_by_frame import compile_step


@dataclass(frozen=True)
class Pass:
    """A step of a run."""

    name: str
    """Of the field of `Run` that its record fills."""
    stage: str
    """Its line on the clock."""
    make: Callable[[Run], Any]
    record: Any = None
    """The class of the record, by which it is kept in the run's folder; None: it is not kept."""
    wanted: Callable[[Run], bool] = lambda run: True
    """Whether the run has this pass; asked when it is its turn, or before."""
    changes_frames: bool = False
    """Whether it finds other frames than passes before, so that what shows these while they are tracked is in vain."""


def _background(run: Run) -> Background:
    images = run.config.images
    found = learn_background(run.clip, images.background, images.cache, run.samples_to_come)
    return said_if_none(run.clip, images.background, found)


def _actors(run: Run) -> Actors:
    """The actors; if they are made, the search for where they begin is compiled meanwhile."""
    beside, compiling = ThreadPoolExecutor(1), None
    try:
        if run.makes_actors and run.pose_sources is SOURCES:
            compiling = beside.submit(lambda: compile_sources(run.clip, run.background, run.config))
        found = kept_or_made(run.actor_request, run.config.images, run.report_actors)
    finally:
        beside.shutdown(wait=False, cancel_futures=True)  # who is refused is told at once
    error = None if compiling is None else compiling.exception()
    if error is not None and not isinstance(error, InputError):  # of wrong input the search itself will tell
        raise error
    return found


def _initial_pose(run: Run) -> InitialPose:
    """The initial pose; meanwhile the tracker is made and compiled.

    What the actors do not lend themselves to is refused before.
    """
    check_formats(run.config.outputs, run.actors.bodies)
    check_pose2sim(run.config.outputs, run.clip.recording, run.clip.numbers, run.actors.bodies, run.config.overwrite)
    _ = run.adjusts
    with ThreadPoolExecutor(1) as beside:
        compiling = [beside.submit(lambda: compile_beforehand(run.setup))]
        with_step = lambda *seen: compiling.append(beside.submit(lambda: compile_step(run.setup.tracker, *seen)))
        request = replace(run.pose_request, told=with_step if run.takes_steps else None)
        try:
            found = find_initial_pose(request, run.pose_sources)
            if found.source == FROM_FILE:
                say_who_is_elsewhere(request, found)
            for each in compiling:
                each.result()
        except BaseException:
            beside.shutdown(wait=False, cancel_futures=True)
            raise
    return found


def _remade(run: Run) -> RemadeActors:
    """The actors of the background that is known by now; what was drawn of a pose of the first ones goes."""
    background, request = run.records["relearnt"].whole, run.pose_request
    request = replace(request, picture=None if run.kept is None else GUESS.of(run.kept))
    found = remake_actors(run.actor_request, run.actors, background, request, run.pose_sources, run.report_actors)
    if found.actors is not None and run.out is not None:
        GUESS.of(run.out).unlink(missing_ok=True)
    return found


def _recolored(run: Run) -> RecoloredActors:
    space, both_ways = run.actor_request.color_space, run.config.tracking.both_ways
    return recolor_actors(run.setup, run.actors, run.frames, space, run.setup_with, both_ways)


def _tracked(run: Run) -> Tracked:
    """The frames, tracked; rows are written as they come, and files that show them if no later pass changes any."""
    log = rows = streams = None
    if run.kept is not None:
        rows = kept_rows(run.kept, run.initial_pose, run.clip.numbers)
        log = FrameLog(run.kept / FRAMES, 0 if rows is None else len(rows))
        ClipFacts.of(run.clip.recording).save(run.kept)
    if run.out is not None and not any(each.changes_frames and each.wanted(run) for each in PASSES):
        run.before_results()
        streams = ResultStreams(run.out, run.clip, run.setup.bodies, run.config.outputs)
    if rows is not None:
        say(f"{run.out}: {len(rows)} of {counted(len(run.clip.numbers), 'frame')} are done; resuming after them")
    beforehand = partial(compile_search, run.setup.tracker) if run.config.tracking.both_ways else lambda *_: None
    table = track_forward(run.setup, run.initial_pose, run.times, log, rows, streams, beforehand)
    if streams is not None:
        run.shown = (table, streams.files)
    return Tracked(table)


PASSES: tuple[Pass, ...] = (
    Pass("background", PREPARING, _background, Background),
    Pass("actors", ACTORS, _actors, Actors),
    Pass("initial_pose", INITIAL_POSE, _initial_pose, InitialPose, wanted=lambda run: run.tracks),
    Pass(
        "relearnt",
        BACKGROUND,
        lambda run: relearn_background(
            run.setup, run.background, run.initial_pose, {each.frame: each.pose for each in run.actors.known_frames}
        ),
        RelearntBackground,
        wanted=lambda run: run.tracks and run.background.is_learnt,
    ),
    Pass("remade", ACTORS, _remade, RemadeActors, wanted=lambda run: run.tracks and run.remakes_actors),
    Pass(
        "keypoint_bias",
        PREPARING,
        lambda run: estimate_keypoint_bias(run.setup, run.initial_pose),
        KeypointBias,
        wanted=lambda run: run.tracks and run.clip.keypoints is not None,
    ),
    Pass("tracked", TRACKING, _tracked, Tracked),
    Pass(
        "occluders",
        TRACKING,
        lambda run: learn_occluders(run.setup, run.frames),
        LearntOccluders,
        wanted=lambda run: run.tracks,
    ),
    Pass(
        "retracked",
        TRACKING,
        lambda run: track_again(run.setup, run.frames, run.records["occluders"]),
        Retracked,
        wanted=lambda run: run.hides_something,
    ),
    Pass(
        "merged",
        BOTH_WAYS,
        lambda run: merge_backward(run.setup, run.frames),
        Merged,
        wanted=lambda run: run.tracks and run.config.tracking.both_ways and run.setup.tracker.limbs is not None,
        changes_frames=True,
    ),
    Pass(
        "recolored",
        BOTH_WAYS,
        _recolored,
        RecoloredActors,
        wanted=lambda run: run.tracks and run.recolors_actors,
    ),  # which seldom finds other frames
    Pass(
        "adjusted",
        ADJUSTING,
        lambda run: adjust_clip(run.first_setup, run.background, run.frames, run.config.color, run.adjust),
        Adjusted,
        wanted=lambda run: run.adjusts,
        changes_frames=True,
    ),
    Pass(
        "filtered",
        FILTERING,
        lambda run: filter_frames(run.frames, run.config.outputs.filter, run.clip.fps, run.actors.bodies),
        Filtered,
        wanted=lambda run: run.config.outputs.filter is not None,
        changes_frames=True,
    ),
    Pass("result", WRITING, judged_result, wanted=lambda run: run.out is not None),
    Pass("files", WRITING, write_results, wanted=lambda run: run.out is not None),
)
"""The passes of `sogjax track`, of `sogjax.track`, of every member of a sweep and of every run of a study; and of
`sogjax adjust`, which is given frames that were tracked."""
BEFORE_TRACKING = tuple(
    each
    for each in PASSES[: [each.name for each in PASSES].index("tracked")]
    if each.name not in ("relearnt", "remade")
)
"""Those that say how the first frame is tracked, without the one for which the whole clip is, and what needs it."""
