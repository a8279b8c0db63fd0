"""`sogjax adjust`: the passes of a run whose frames were tracked before."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from sogjax.io.frame_table import FrameTable
from sogjax.io.motion import Motion
from sogjax.refine.clip_priors import step_of
from sogjax.run import build
from sogjax.run.actors import Actors
from sogjax.run.adjust_cameras import check_cameras, parts_in_question
from sogjax.run.adjust_checks import check_length, check_window
from sogjax.run.adjust_clip import AdjustRequest
from sogjax.run.fingerprint import RunFingerprint, digest
from sogjax.run.forward import Tracked
from sogjax.run.recordings import opened
from sogjax.run.result import RunResult
from sogjax.run.run import Run
from sogjax.run.run_folder import run_folder
from sogjax.run.runner import run_passes
from sogjax.run.track import opened_clip
from sogjax.run.tracked_motion import TrackedMotion
from sogjax.run.write import check_pose2sim, export_endings
from sogjax.settings.run import AdjustConfig


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
    if outputs.pose2sim:
        check_pose2sim(recording, (int(motion.frame[0]), int(motion.frame[-1])), [tracked.actor], config.overwrite)
    check_cameras(recording, motion, config.cameras, config.offsets)
    first = int(motion.frame[0]) - recording.first_frame
    settings = replace(
        tracked.config,
        **{"recording": config.recording, "out": config.out, "actor": None, "adjust": True, "outputs": outputs},
        **{"start": first, "stop": int(motion.frame[-1]) - recording.first_frame + 1},
        every=step_of(motion.frame),
    )
    build.check(settings)
    request = AdjustRequest(config.window, config.shape, parts_in_question(config.cameras, config.offsets))
    fingerprint: RunFingerprint = {"motion": str(tracked.path), "actor": digest(tracked.actor)}
    with run_folder(path, config.overwrite, command="adjust") as folder:
        folder.begin("adjust", fingerprint)
        run = Run(
            clip=opened_clip(recording, settings).kept_in(folder.kept, settings.images.cache),
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
        pose=motion.pose,
        energy=motion.energy,
        iterations=motion.iterations,
        evaluations=motion.iterations,
        converged=motion.converged,
        num_near=np.zeros((count, 1), int),
        num_matching=np.zeros((count, 1), int),
        num_blocks=np.zeros(count, int),
        capacities=np.zeros((count, 3), int),
        terms={"similarity": motion.similarity},
    )
