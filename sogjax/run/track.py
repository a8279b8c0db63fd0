"""Runs of the passes: into a folder, as the commands do, or without files, as a program does."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from sogjax.actor.make import MadeActor
from sogjax.energy.term import Term
from sogjax.io.frame_motions import load_motions
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.quality.proportions import odd_sentence
from sogjax.run import build
from sogjax.run.actor_report import PAGE, report_folder, write_actor_report
from sogjax.run.actors import ActorRequest, Actors, make_actors
from sogjax.run.background import Background
from sogjax.run.clip import Clip
from sogjax.run.clip_keypoints import clip_keypoints
from sogjax.run.clock import ACTORS, StageTimes, stage
from sogjax.run.example_frames import check_actors
from sogjax.run.filter import check_cutoff
from sogjax.run.fingerprint import run_fingerprint
from sogjax.run.initial_pose import SOURCES, PoseSource, described_poses, pose_file
from sogjax.run.judge import compared, kept_verdicts
from sogjax.run.kept_actors import forget_actors
from sogjax.run.memory import forget_programs_if_many
from sogjax.run.page import FRAMES_ON_PAGE
from sogjax.run.recordings import chosen_frames, file_list, opened, upright
from sogjax.run.result import RunResult
from sogjax.run.run import Run
from sogjax.run.run_files import ACTOR, METRICS, MOTION
from sogjax.run.run_folder import RunFolder, run_folder
from sogjax.run.runner import run_passes
from sogjax.run.terminal import say
from sogjax.run.write import check_formats, check_pose2sim, export_endings
from sogjax.settings.run import TrackConfig


def track_to_folder(
    config: TrackConfig, command: str = "track", pose_sources: Sequence[PoseSource] = SOURCES
) -> RunResult:
    """Track, compare with the ground truth if there is one, and write the results; or resume a run that was stopped.

    Raises:
        InputError: an invalid recording, actor or setting; a folder that another run uses, or whose results must stay.
    """
    config = replace(config, outputs=config.outputs.asked())
    build.check(config)
    export_endings(config.outputs)
    recording = opened(config.recording, config.cameras)
    files = None if config.actor is None else file_list(config.actor)
    check_actors(recording, config.actors, None if files is None else len(files))
    chosen_frames(recording, config.start, config.stop, config.every)
    check_cutoff(config.outputs.filter, recording.fps / config.every)
    poses = pose_file(recording, config)
    path = Path(config.out or f"outputs/{recording.name}")
    with run_folder(path, config.overwrite, config.resume, command) as folder:
        with stage(ACTORS):
            given = None if files is None else _given_actors(recording, config, files)
        fingerprint = run_fingerprint(recording, config, None if given is None else given.bodies, poses)
        going_on = folder.goes_on(fingerprint)
        if folder.ended:
            return _ended(folder, recording)
        if not going_on:
            folder.begin(command, fingerprint)
            if given is not None:
                given.save(folder.kept)
        run = Run(
            clip=with_pictures(
                opened_clip(recording, config).kept_in(folder.kept, config.images.cache), config, folder
            ),
            config=config,
            out=path,
            kept=folder.kept,
            pose_sources=pose_sources,
            report_actors=lambda made: _report_actors(made, recording, path),
            before_results=lambda: None if going_on else folder.clear(files or []),
            records={} if given is None else {"actors": given},
        )
        if given is not None:
            _ = run.adjusts  # refused before any work, where it cannot be
        run_passes(run)
        folder.finish(command, fingerprint, run.files)
        if run.makes_actors:
            forget_actors(run.actor_request, config.images)
    return replace(run.result, files=run.files)


def track_recording(
    recording: Recording,
    bodies: Sequence[Body],
    config: TrackConfig,
    terms: Sequence[Term] = (),
    pose_sources: Sequence[PoseSource] = SOURCES,
) -> Run:
    """The run in which actors (in their own upright frames) were tracked; no files are written.

    Args:
        recording: that is tracked.
        bodies: the actors.
        config: the settings.
        terms: of the energy, beside those of the settings.
        pose_sources: of the initial pose.
    """
    check_cutoff(config.outputs.filter, recording.fps / config.every)
    forget_programs_if_many()
    config = replace(config, outputs=replace(config.outputs, motion_only=True).asked())
    with TemporaryDirectory() as folder:
        run = Run(
            clip=opened_clip(recording, config).kept_in(Path(folder), config.images.cache),
            config=config,
            terms=terms,
            pose_sources=pose_sources,
            records={"actors": Actors(tuple(bodies))},
        )
        return run_passes(run)


def opened_clip(recording: Recording, config: TrackConfig) -> Clip:
    """The frames of a recording that the settings name, with keypoints if these count."""
    numbers = chosen_frames(recording, config.start, config.stop, config.every)
    return Clip(recording, numbers, config.images.depth, clip_keypoints(recording, config))


def with_pictures(clip: Clip, config: TrackConfig, folder: RunFolder) -> Clip:
    """The clip with the small pictures that the run's page shows, if it is wanted."""
    return clip.shown_small(folder.kept, FRAMES_ON_PAGE) if config.outputs.page else clip


def _given_actors(recording: Recording, config: TrackConfig, files: Sequence[Path]) -> Actors:
    """The actors of files; what is wrong with them, or with a rough pose of theirs, shows before any work."""
    clip = Clip(recording, recording.frames, config.images.depth)
    request = ActorRequest(clip, lambda: Background(None), files, number=config.actors)
    actors = make_actors(request)
    check_formats(config.outputs, actors.bodies)
    numbers = chosen_frames(recording, config.start, config.stop, config.every)
    check_pose2sim(config.outputs, recording, numbers, actors.bodies, config.overwrite)
    described_poses(recording, [upright(body, recording) for body in actors.bodies], config)
    return actors


def _report_actors(made: Sequence[MadeActor], recording: Recording, out: Path) -> None:
    """Write how actors fit the frames of the videos that they were made of, for the user to judge."""
    for actor in (actor for actor in made if actor.frames):
        folder = report_folder(ACTOR.of(out, actor.body.name, len(made)))
        report = write_actor_report(folder, actor, recording.rig)
        say(f"{actor.body.name}: silhouettes and masks agree to {report.mean_iou:.2f}; see {folder / PAGE}")
        if (odd := odd_sentence(actor.body, actor.start)) is not None:
            say(f"warning: {actor.body.name}: {odd}")


def _ended(folder: RunFolder, recording: Recording) -> RunResult:
    """The result of a run that ended before."""
    say(f"{folder.path}: the run has already ended; nothing to do")
    files = [folder.path / name for name in folder.note["files"]]
    written = [path for path in files if MOTION.matches(path.name)]
    motions = {name: motion for path in written for name, motion in load_motions(path).items()}
    missing = recording.num_missing(next(iter(motions.values())).frame.tolist())
    result = RunResult(recording, (), motions, StageTimes(), float("nan"), files=files, missing=missing)
    result.verdicts = kept_verdicts(METRICS.of(folder.path))
    result.evaluation = compared(recording, motions)
    return result
