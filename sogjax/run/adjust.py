"""Adjusted clips as the files of a run."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from omegaconf import OmegaConf

from sogjax.io.recording import open_recording
from sogjax.quality.numbers import write_json
from sogjax.run.adjust_cameras import camera_lines, check_cameras, parts_in_question, write_cameras
from sogjax.run.adjust_checks import check_length, check_window
from sogjax.run.adjust_clip import AdjustedClip, adjusted_clip, sentence
from sogjax.run.cells import picture_reader
from sogjax.run.clock import ADJUSTING, stage
from sogjax.run.kept_run import KeptRun
from sogjax.run.origin import Origin, digest
from sogjax.run.outputs import check_pose2sim, export_endings, write_results
from sogjax.run.recordings import opened
from sogjax.run.run import Run
from sogjax.run.run_folder import run_folder
from sogjax.run.run_job import known_job
from sogjax.run.tracked_motion import TrackedMotion
from sogjax.settings.method import ImagesConfig
from sogjax.settings.run import AdjustConfig, OutputsConfig

NUMBERS = "adjustment.json"


def adjust_to_folder(config: AdjustConfig) -> Run:
    """Adjust a motion of one actor, and write it as a run does, with the actor that was learnt.

    Raises:
        InputError: a motion of another recording or body, a clip that is too short, a window that does not fit into
            memory, or a folder whose results must stay.
    """
    config = replace(config, outputs=config.outputs.asked())
    export_endings(config.outputs)
    recording = opened(config.recording)
    path = Path(config.out or f"outputs/{recording.name}_adjusted")
    tracked = TrackedMotion.from_files(config.motion, recording, config.actor)
    if tracked.config.cameras is not None:
        recording = opened(config.recording, tracked.config.cameras)
    check_length(tracked.motion)
    check_window(len(recording.rig), tracked.actor.num_blobs, tracked.motion.num_frames, config.window)
    if config.outputs.pose2sim:
        first, last = int(tracked.motion.frame[0]), int(tracked.motion.frame[-1])
        check_pose2sim(recording, (first, last), [tracked.actor], config.overwrite)
    check_cameras(recording, tracked.motion, config.cameras, config.offsets)
    in_question = parts_in_question(config.cameras, config.offsets)
    with run_folder(path, config.overwrite, command="adjust") as folder:
        with stage(ADJUSTING):
            clip = adjusted_clip(
                recording, tracked.actor, tracked.motion, tracked.config, config.window, config.shape, in_question
            )
        origin: Origin = {"motion": str(tracked.path), "actor": digest(tracked.actor)}
        folder.begin("adjust", origin, tracked.files)
        with written(clip, path, config.outputs, tracked.config.images) as result:
            used = replace(tracked.config, recording=config.recording, out=config.out, actor=None, adjust=True)
            write_results(result, path, config.outputs, OmegaConf.structured(used), [clip.actor])
            write_numbers(clip, result, path)
            if in_question:
                if clip.numbers["cameras"]:
                    result.files += write_cameras(recording, open_recording(Path(config.recording)), clip.moves, path)
                print(camera_lines(clip.numbers["cameras"], recording.rig.names))
            folder.finish("adjust", origin, result.files)
        folder.kept.remove()
    return result


def write_numbers(clip: AdjustedClip, result: Run, out: Path) -> None:
    """Write what was changed beside the other results, and print it."""
    write_json(out / NUMBERS, clip.numbers)
    result.files.append(out / NUMBERS)
    print(sentence(clip.numbers))


@contextmanager
def written(
    clip: AdjustedClip, out: Path, outputs: OutputsConfig, images: ImagesConfig, kept: KeptRun | None = None
) -> Iterator[Run]:
    """The run of an adjusted clip, with the files that show its pictures; as `run_job`.

    With the frames `kept` that were adjusted, a run that is stopped meanwhile can be resumed.
    """
    with known_job(clip.job, clip.prefix, outputs, out, picture_reader(images), kept) as result:
        yield result
