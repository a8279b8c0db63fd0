"""The files of a run that are written when all is known: motions, actors, settings, metrics, the worst frames."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from omegaconf import OmegaConf

from sogjax.errors import InputError
from sogjax.io.actor_file import save_body
from sogjax.io.export.points import require_ezc3d, write_trc
from sogjax.io.export.write import NEEDS, WRITERS, endings_beside, export_motion
from sogjax.io.files import write_file, write_json
from sogjax.io.frame_motions import ClipFacts, motions_of
from sogjax.io.image_file import write_image
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.io.motion import motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.io.projects import CONFIG as PROJECT
from sogjax.io.recording import Recording, open_recording
from sogjax.model.body import Body
from sogjax.run import clock
from sogjax.run.adjust_cameras import camera_lines, write_cameras
from sogjax.run.adjust_clip import Adjusted, sentence
from sogjax.run.clock import stage
from sogjax.run.forward import show_known
from sogjax.run.judge import worst_images, write_metrics
from sogjax.run.page import write_page
from sogjax.run.result_streams import ResultStreams
from sogjax.run.run import Run
from sogjax.run.run_files import (
    ACTOR,
    ADJUSTMENT,
    CONFIG,
    GUESS,
    METRICS,
    MOTIONS,
    OCCLUDERS,
    PAGE,
    UNADJUSTED,
    UNADJUSTED_ACTOR,
    WORST,
)
from sogjax.run.terminal import say
from sogjax.settings.run import OutputsConfig
from sogjax.view.overlay import below_each_other, closeups
from sogjax.view.sheets import write_occluders

POSE2SIM_SCHEME = "HALPE_26"
"""The scheme of the points written for Pose2Sim: its default."""


def export_endings(wanted: OutputsConfig) -> list[str]:
    """The formats of motions to write beside motion.npz, as file endings.

    Raises:
        InputError: a format that cannot be written.
    """
    formats = (["bvh"] if wanted.bvh else []) + (wanted.formats or [])
    for name in formats:
        if f".{name}" not in WRITERS or name == "npz":
            known = ", ".join(sorted(ending[1:] for ending in WRITERS if ending != ".npz"))
            raise InputError(f"outputs.formats={name}: no such format; use some of {known}")
        if name == "c3d":
            require_ezc3d("outputs.formats=c3d")
    return [f".{name}" for name in dict.fromkeys(formats)]


def check_formats(wanted: OutputsConfig, bodies: Sequence[Body]) -> None:
    """Check that the bodies have what the formats need.

    Raises:
        InputError: one has not.
    """
    for needs in (NEEDS[ending] for ending in export_endings(wanted) if ending in NEEDS):
        for body in bodies:
            needs(motion_from_poses(body, np.zeros((1, body.skeleton.num_dofs), np.float32), 1.0))


def pose2sim_file(recording: Recording, frames: tuple[int, int], actor: str = "") -> Path:
    """Where Pose2Sim's next steps look for the points of a trial; `frames`: first and last."""
    person = f"_{actor}" if actor else ""
    return recording.path / "pose-3d" / f"{recording.name}{person}_{frames[0]}-{frames[1]}.trc"


def check_pose2sim(
    wanted: OutputsConfig, recording: Recording, frames: Sequence[int], bodies: Sequence[Body], replaced: bool
) -> None:
    """Check that points of the frames can be written into a Pose2Sim project, if they are wanted.

    Raises:
        InputError: the recording is none, or has them already, or a body lacks one of the points.
    """
    if not wanted.pose2sim:
        return
    if not (recording.path / PROJECT).is_file():
        raise InputError(f"outputs.pose2sim=true: {recording.path} is no Pose2Sim project (no {PROJECT}); leave it out")
    for body in bodies:
        path = pose2sim_file(recording, (frames[0], frames[-1]), body.name if len(bodies) > 1 else "")
        if path.exists() and not replaced:
            raise InputError(f"{path}: already exists; move it away, or give overwrite=true to replace it")
        lacking = set(named_scheme(POSE2SIM_SCHEME).landmarks) - {*body.landmarks.names, *body.skeleton.names}
        if lacking:
            raise InputError(
                f"outputs.pose2sim=true: {body.name} has no landmark {min(lacking)}, one of {POSE2SIM_SCHEME}; leave "
                "it out, or add the landmark to the body file"
            )


def write_results(run: Run) -> list[Path]:
    """Write the files of a run; each appears under its name only when it is complete.

    Raises:
        InputError: a file cannot be written, or a picture cannot be read.
    """
    out, wanted, result, files = run.out, run.config.outputs, run.result, []
    assert out is not None
    run.before_results()
    grown = _grown(run, out)  # first, as it takes longest
    made, count = run.made_bodies, len(result.motions)
    for actor in made:
        files.append(ACTOR.of(out, actor.name, len(made)))
        save_body(files[-1], actor)
    for name, motion in result.motions.items():
        asked = [".npz", *export_endings(wanted)]
        beside = [other for ending in asked for other in endings_beside(ending, motion)]
        for ending in dict.fromkeys([*asked, *beside]):
            files.append(MOTIONS[ending].of(out, name, count))
            if (said := export_motion(motion, files[-1])) is not None:
                say(f"{files[-1]}: {said}")
        if wanted.pose2sim:
            span = int(motion.frame[0]), int(motion.frame[-1])
            path = pose2sim_file(result.recording, span, name if count > 1 else "")
            write_trc(path, motion, motion.up, POSE2SIM_SCHEME)
            say(f"{path}: written for Pose2Sim's next steps")
    files.append(CONFIG.of(out))
    write_file(files[-1], OmegaConf.to_yaml(OmegaConf.structured(run.config)))
    files.append(METRICS.of(out))
    write_metrics(files[-1], result)
    images = {} if wanted.motion_only else worst_images(result)
    worst = closeups(images.items(), result.recording.rig, list(result.motions.values()))
    if worst:
        files.append(WORST.of(out))
        write_image(files[-1], below_each_other([*worst.values()]))
    if GUESS.of(out).is_file():
        files.append(GUESS.of(out))
    files += _occluders(run, out)
    files += grown
    if run.adjusted is not None:
        files += _of_adjusting(run, run.adjusted, out)
    if wanted.page:  # last, as it names the others
        files.append(PAGE.of(out))
        with stage(clock.PAGE):
            write_page(files[-1], run, worst, images)
    return files


def _occluders(run: Run, out: Path) -> list[Path]:
    """What was learnt to stand in front, over the pictures of the first frame in which it hides somebody."""
    if not run.hides_something:
        return []
    learnt, clip = run.records["occluders"], run.clip
    frame = clip.numbers[learnt.rows[0]]
    title = "what was learnt to stand in front"
    return [write_occluders(OCCLUDERS.of(out), clip.recording, clip.grids, learnt.hidden, frame, title)]


def _grown(run: Run, out: Path) -> list[Path]:
    """The files that show frames; written now, unless they were written while the frames that hold were tracked."""
    setup, table = run.final_setup, run.frames
    if run.shown is not None and run.shown[0] is table:
        return run.shown[1]
    streams = ResultStreams(out, setup.clip, setup.bodies, run.config.outputs)
    if streams.show_frames:
        show_known(setup, table, streams)
    return streams.files


def _of_adjusting(run: Run, adjusted: Adjusted, out: Path) -> list[Path]:
    """What was changed, and what it was before."""
    files = [ADJUSTMENT.of(out)]
    write_json(files[0], adjusted.numbers)
    print(sentence(adjusted.numbers))
    if run.tracks:
        files += [UNADJUSTED.of(out), UNADJUSTED_ACTOR.of(out)]
        facts = ClipFacts.of(run.clip.recording)
        save_motion(files[1], next(iter(motions_of(run.unadjusted, run.first_setup.bodies, facts).values())))
        save_body(files[2], run.actors.bodies[0])
    if run.adjust.in_question:
        recording = run.clip.recording
        if adjusted.numbers["cameras"]:
            files += write_cameras(recording, open_recording(recording.path), adjusted.moves, out)
        print(camera_lines(adjusted.numbers["cameras"], recording.rig.names))
    return files
