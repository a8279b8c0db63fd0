"""From the videos of a recording to the motion of its actors, with or without files."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Array, Float
from omegaconf import OmegaConf

from sogjax.actor.make import MadeActor
from sogjax.energy.term import Term
from sogjax.errors import InputError
from sogjax.io.actor_file import save_body
from sogjax.io.motion import arrays_of, load_motion, save_motion
from sogjax.io.motion_log import PER_FRAME, SOMETIMES_PER_FRAME
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.run import build
from sogjax.run.actor_report import report_folder, write_actor_report
from sogjax.run.adjust import write_numbers, written
from sogjax.run.adjust_checks import check_window, too_short
from sogjax.run.adjust_clip import adjusted_clip
from sogjax.run.clock import ACTORS, ADJUSTING, StageTimes, stage
from sogjax.run.example_frames import check_actors
from sogjax.run.first_pose import initial_pose_file, known_opening
from sogjax.run.job import frame_range
from sogjax.run.kept_run import KeptRun
from sogjax.run.memory import forget_programs_if_many
from sogjax.run.origin import origin_of
from sogjax.run.outputs import actor_name, check_pose2sim, evaluate, export_endings, write_results
from sogjax.run.recordings import actors_of, file_list, opened
from sogjax.run.run import Run
from sogjax.run.run_folder import RunFolder, run_folder
from sogjax.run.run_job import tracking
from sogjax.run.streams import file_name
from sogjax.run.terminal import say
from sogjax.run.verdict import METRICS, kept_verdicts
from sogjax.settings.run import OutputsConfig, TrackConfig

Opening = Callable[[Recording, Sequence[Body], TrackConfig], tuple[Float[Array, "dof"], int] | None]
"""Tells the first pose and its frame, counted from the recording's first; None: they are searched for."""
NOTHING = OutputsConfig(motion_only=True).asked()
UNADJUSTED = "unadjusted.npz"
UNADJUSTED_ACTOR = "unadjusted_actor.yaml"
"""The motion as it was tracked, and its actor, beside the adjusted ones."""
_ROWS = (*PER_FRAME, *SOMETIMES_PER_FRAME)


def track_to_folder(config: TrackConfig, command: str = "track", opening: Opening | None = None) -> Run:
    """Track, evaluate if there is ground truth, and write the results; or resume a run that was stopped.

    `opening` is asked for the first pose where the making of the actors does not tell it.

    Raises:
        InputError: an invalid recording, actor or setting; a folder that another run uses, or whose results must stay.
    """
    config = replace(config, outputs=config.outputs.asked())
    build.check(config)
    export_endings(config.outputs)
    recording = opened(config.recording, config.cameras)
    check_actors(recording, config.actors, None if config.actor is None else len(file_list(config.actor)))
    frame_range(recording, config)
    initial_pose_file(recording, config)
    path = Path(config.out or f"outputs/{recording.name}")
    with run_folder(path, config.overwrite, config.resume, command) as folder:
        return _run_in(folder, recording, config, command, opening)


def _run_in(folder: RunFolder, recording: Recording, config: TrackConfig, command: str, opening: Opening | None) -> Run:
    """Track into this run's own folder, or resume there."""
    actors = partial(actors_of, recording, config.actor, config.body, config.color, config.images, config.actors)
    made = config.actor is None
    with stage(ACTORS):
        bodies = None if made else actors()[0]
    origin = origin_of(recording, config, bodies)
    going_on, kept = folder.goes_on(origin), folder.kept
    if folder.ended:
        return _ended(folder, recording)
    if bodies is None and going_on:
        bodies = kept.actors()
    anew, found = bodies is None, []
    if bodies is None:
        with stage(ACTORS):
            bodies, found = actors()
    if not going_on:
        folder.begin(command, origin, [] if made else file_list(config.actor))
    if config.outputs.pose2sim:
        first, last = (frame + recording.first_frame for frame in frame_range(recording, config))
        check_pose2sim(recording, (first, last - 1), bodies, config.overwrite)
    if anew:
        kept.keep_actors(bodies)
        with stage(ACTORS):
            _report_actors(recording, found, folder.path)
        if (known := known_opening(recording, found, config)) is not None:
            kept.keep_start(*known)
    if opening is not None and kept.start() is None and (shared := opening(recording, bodies, config)) is not None:
        kept.keep_start(*shared)
    adjust = config.adjust and _adjustable(recording, bodies, config)
    shown = NOTHING if adjust else config.outputs
    with tracking(recording, bodies, config, shown, folder.path, kept=kept, stays=adjust) as result:
        if not adjust:
            write_results(result, folder.path, config.outputs, OmegaConf.structured(config), bodies if made else [])
            folder.finish(command, origin, result.files)
            return result
        unadjusted = [folder.path / UNADJUSTED, folder.path / UNADJUSTED_ACTOR]
        save_motion(unadjusted[0], next(iter(result.motions.values())))
        save_body(unadjusted[1], bodies[0])
        with stage(ADJUSTING):
            clip = adjusted_clip(recording, bodies[0], load_motion(unadjusted[0]), config)
    times = result.times
    # The pictures are read once more, for the files that show the adjusted poses in them.
    with written(clip, folder.path, config.outputs, config.images, kept) as result:
        write_results(result, folder.path, config.outputs, OmegaConf.structured(config), [clip.actor])
        result.files += unadjusted
        result.times = times
        write_numbers(clip, result, folder.path)
        folder.finish(command, origin, result.files)
    return result


def _adjustable(recording: Recording, bodies: Sequence[Body], config: TrackConfig) -> bool:
    """Whether the clip is long enough to be adjusted; if not, that is said.

    Raises:
        InputError: there are several actors, or its pictures do not fit into memory.
    """
    if len(bodies) > 1:
        raise InputError("adjust=true: only a clip of one actor can be adjusted; leave adjust=true out")
    first, last = frame_range(recording, config)
    reason = too_short(last - first)
    if reason is not None:
        say(f"adjust=true: {reason}")
        return False
    check_window(len(recording.rig), bodies[0].num_blobs, last - first)
    return True


def _report_actors(recording: Recording, made: Sequence[MadeActor], out: Path) -> None:
    """Write how actors fit the frames of the videos that they were made of, for the user to judge."""
    for actor in (actor for actor in made if actor.frames):
        folder = report_folder(out / file_name("actor", ".yaml", actor.body.name, len(made)))
        for older in folder.glob("silhouettes_*.png"):
            older.unlink()
        report = write_actor_report(folder, actor, recording.rig)
        say(f"{actor.body.name}: silhouettes and masks agree to {report.mean_iou:.2f}; see {folder / 'report.md'}")


def _ended(folder: RunFolder, recording: Recording) -> Run:
    """A run that ended before."""
    say(f"{folder.path}: the run has already ended; nothing to do")
    files = [folder.path / name for name in folder.note["files"]]
    loaded = {path: load_motion(path) for path in files if path.suffix == ".npz" and path.name != UNADJUSTED}
    motions = {actor_name(path, motion): motion for path, motion in loaded.items()}
    frames = next(iter(motions.values())).frame - recording.first_frame
    missing = recording.num_missing(frames.tolist())
    result = Run(recording, [], motions, StageTimes(), float("nan"), files=files, missing=missing)
    result.verdicts = kept_verdicts(folder.path / METRICS)
    evaluate(result)
    return result


def track_recording(recording: Recording, bodies: list[Body], config: TrackConfig, terms: Sequence[Term] = ()) -> Run:
    """Track actors (in their own upright frames) without writing files; `terms` are added to those of the settings."""
    forget_programs_if_many()
    with (
        TemporaryDirectory() as folder,
        tracking(recording, bodies, config, NOTHING, Path(folder), KeptRun(Path(folder), lasts=False), terms) as result,
    ):
        motions = {
            name: replace(motion, **{key: np.array(rows) for key, rows in arrays_of(motion).items() if key in _ROWS})
            for name, motion in result.motions.items()
        }
    result = replace(result, motions=motions)
    if config.adjust and _adjustable(recording, bodies, config):
        with stage(ADJUSTING):
            clip = adjusted_clip(recording, bodies[0], next(iter(motions.values())), config)
        result = replace(result, bodies=clip.job.bodies, motions={bodies[0].name: clip.motion})
    return result
