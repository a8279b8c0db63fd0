"""`sogjax adjust`: a motion that was tracked before, with what belongs to it, and the passes that are left."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.frame_table import FrameTable
from sogjax.io.motion import Motion, load_motion, motion_from_poses
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.refine.clip_priors import step_of
from sogjax.run import build
from sogjax.run.actors import Actors
from sogjax.run.adjust_cameras import check_cameras, parts_in_question
from sogjax.run.adjust_checks import check_length, check_window
from sogjax.run.adjust_clip import AdjustRequest
from sogjax.run.filter import check_cutoff
from sogjax.run.fingerprint import RunFingerprint, digest
from sogjax.run.forward import Tracked
from sogjax.run.recordings import opened, upright
from sogjax.run.result import RunResult
from sogjax.run.run import Run
from sogjax.run.run_files import ACTOR, CONFIG, MOTION
from sogjax.run.run_folder import run_folder
from sogjax.run.runner import run_passes
from sogjax.run.track import opened_clip, with_pictures
from sogjax.run.write import check_formats, check_pose2sim, export_endings
from sogjax.settings.compose import as_object, without_removed
from sogjax.settings.run import AdjustConfig, TrackConfig

SAME_PLACE = 2e-3
"""Metres by which the blobs of a file and those of the actor in the same pose may differ."""


@dataclass(frozen=True)
class TrackedMotion:
    """What belongs to a motion."""

    path: Path
    motion: Motion
    actor: Body
    """The actor in its own upright frame."""
    config: TrackConfig
    """The settings with which it was tracked; the defaults where that is not known."""
    files: tuple[Path, ...]
    """The files that were read."""

    @classmethod
    def from_files(cls, motion: str, recording: Recording, actor: str | None) -> "TrackedMotion":
        """A run's folder or a motion file; the actor and the settings are looked for beside it.

        Raises:
            InputError: files that are missing, unreadable, or of another recording or body.
        """
        path = _motion_file(Path(motion))
        config = kept_config(CONFIG.of(path.parent))
        file = _actor_file(path, config, actor)
        found = cls(path, load_motion(path), load_body(file), config, (path, file))
        check_recording(found.path, found.motion, recording)
        _check_body(found, file, recording)
        return found


def _motion_file(path: Path) -> Path:
    if not path.is_dir():
        return path
    file = MOTION.of(path)
    if not file.is_file() and any(MOTION.matches(other.name) for other in path.iterdir()):
        raise InputError(f"motion={path}: holds the motions of several actors; only a clip of one can be adjusted")
    if not file.is_file():
        raise InputError(f"motion={path}: this folder holds no {file.name}; give the folder of a run, or the file")
    return file


def kept_config(path: Path) -> TrackConfig:
    """The settings of the run beside a motion."""
    if not path.is_file():
        return TrackConfig()
    try:
        kept = without_removed(OmegaConf.load(path))
        return as_object(OmegaConf.merge(OmegaConf.structured(TrackConfig), kept), "track")
    except (OmegaConfBaseException, yaml.YAMLError, ValueError, OSError) as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{path}: is no configuration of a track ({reason}); move it away to use defaults") from error


def _actor_file(path: Path, config: TrackConfig, actor: str | None) -> Path:
    if actor is not None:
        return Path(actor)
    if (beside := ACTOR.of(path.parent)).is_file():
        return beside
    if isinstance(config.actor, str) and Path(config.actor).is_file():
        return Path(config.actor)
    raise InputError(f"{path}: its actor is not beside it; give actor=FILE, the one it was tracked with")


def check_recording(path: Path, motion: Motion, recording: Recording) -> None:
    """Check that a motion can be one of a recording.

    Raises:
        InputError: frames that it does not have, or another frame rate or vertical.
    """
    first, last = recording.first_frame, recording.first_frame + recording.num_frames - 1
    remedy = "give the recording in which it was tracked"
    if motion.num_frames == 0 or motion.frame[0] < first or motion.frame[-1] > last:
        theirs = f"{motion.frame[0]} to {motion.frame[-1]}" if motion.num_frames else "none"
        raise InputError(f"{path}: has the frames {theirs}, {recording.path} those from {first} to {last}; {remedy}")
    if not np.isclose(motion.fps, recording.fps, rtol=1e-3):
        raise InputError(f"{path}: has {motion.fps:g} frames per second, {recording.path} {recording.fps:g}; {remedy}")
    if motion.up != recording.up:
        raise InputError(f"{path}: its vertical is {motion.up}, that of {recording.path} {recording.up}; {remedy}")


def _check_body(tracked: TrackedMotion, file: Path, recording: Recording) -> None:
    """Check that the blobs of the motion are the actor's."""
    motion, body = tracked.motion, upright(tracked.actor, recording)
    same = motion.dof_names.tolist() == list(body.skeleton.dof_names) and len(motion.blob_sigma) == body.num_blobs
    if same:
        posed = motion_from_poses(body, motion.pose[:1], motion.fps, up=motion.up)
        same = bool(np.abs(posed.blob_means[0] - motion.blob_means[0]).max() < SAME_PLACE)
    if not same:
        raise InputError(f"{tracked.path}: is not a motion of {file}; give actor=FILE, the one it was tracked with")


def adjust_to_folder(config: AdjustConfig) -> RunResult:
    """Adjust a motion of one actor, and write it as a run does, with the actor that was learnt.

    Raises:
        InputError: a motion of another recording or body, a clip that is too short, a window that does not fit into
            memory, a wrong setting, or a folder whose results must stay.
    """
    outputs = config.outputs.asked()
    export_endings(outputs)
    recording = opened(config.recording)
    path = Path(config.out or f"outputs/{recording.name}_adjusted")
    tracked = TrackedMotion.from_files(config.motion, recording, config.actor)
    if tracked.config.cameras is not None:
        recording = opened(config.recording, tracked.config.cameras)
    motion = tracked.motion
    check_length(motion.num_frames)
    check_window(len(recording.rig), tracked.actor.num_blobs, motion.num_frames, config.window)
    check_formats(outputs, [tracked.actor])
    check_pose2sim(outputs, recording, motion.frame.tolist(), [tracked.actor], config.overwrite)
    check_cameras(recording, motion, config.cameras, config.offsets)
    first = int(motion.frame[0]) - recording.first_frame
    settings = replace(
        tracked.config,
        **{"recording": config.recording, "out": config.out, "actor": None, "adjust": True, "outputs": outputs},
        **{"start": first, "stop": int(motion.frame[-1]) - recording.first_frame + 1},
        every=step_of(motion.frame),
    )
    build.check(settings)
    check_cutoff(outputs.filter, recording.fps / settings.every)
    request = AdjustRequest(config.window, config.shape, parts_in_question(config.cameras, config.offsets))
    fingerprint: RunFingerprint = {"motion": str(tracked.path), "actor": digest(tracked.actor)}
    with run_folder(path, config.overwrite, command="adjust") as folder:
        folder.begin("adjust", fingerprint)
        run = Run(
            clip=with_pictures(
                opened_clip(recording, settings).kept_in(folder.kept, settings.images.cache), settings, folder
            ),
            config=settings,
            out=path,
            kept=folder.kept,
            adjust=request,
            frames_given=True,
            before_results=lambda: folder.clear(tracked.files),
            records={"actors": Actors((tracked.actor,)), "tracked": Tracked(_table(motion))},
        )
        run_passes(run)
        folder.finish("adjust", fingerprint, run.files)
    return replace(run.result, files=run.files)


def _table(motion: Motion) -> FrameTable:
    """The frames of a motion, as far as it tells of them."""
    count = motion.num_frames
    return FrameTable(
        frame=np.asarray(motion.frame, int),
        pose=motion.pose if motion.unfiltered_pose is None else motion.unfiltered_pose,
        energy=motion.energy,
        iterations=motion.iterations,
        evaluations=motion.iterations,
        converged=motion.converged,
        num_near=np.zeros((count, 1), int),
        num_matching=np.zeros((count, 1), int),
        num_blocks=np.zeros(count, int),
        capacities=np.zeros((count, 3), int),
        limb_rival=motion.limb_rival,
        terms={"similarity": motion.similarity},
    )
