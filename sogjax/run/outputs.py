"""The files of a run that are written when it has ended: motion, configuration, metrics, BVH."""

import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from sogjax.errors import InputError
from sogjax.io.actor_file import save_body
from sogjax.io.export.points import require_ezc3d, write_trc
from sogjax.io.export.write import WRITERS, export_motion
from sogjax.io.files import atomic_path
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.io.motion import Motion, save_motion
from sogjax.io.projects import CONFIG
from sogjax.io.recording import Recording
from sogjax.model.body import Body
from sogjax.quality.evaluation import evaluate_motions
from sogjax.run.clock import WRITING, stage
from sogjax.run.run import Run
from sogjax.run.streams import file_name
from sogjax.run.terminal import say
from sogjax.run.verdict import METRICS, WORST, judge, write_metrics, write_worst
from sogjax.settings.run import OutputsConfig

POSE2SIM_SCHEME = "HALPE_26"
"""Of the points written for Pose2Sim: its default."""


@contextmanager
def results_folder(path: Path) -> Iterator[Path]:
    """The folder for results, created if missing; problems show before the work begins.

    If the work ends with an error, folders created for it are removed unless they hold something.

    Raises:
        InputError: it cannot be created or written.
    """
    made = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        _make_writable(path)
        yield path
    except BaseException:
        for folder in made:
            with suppress(OSError):
                folder.rmdir()
        raise


def _make_writable(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / f".probe-{uuid.uuid4().hex}"
        probe.touch()
        probe.unlink()
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(f"{path}: cannot write there ({reason}); choose another folder with out=DIR") from error


def free_path(key: str, value: str | Path, overwrite: bool) -> Path:
    """The path of an output, if it is free or may be replaced.

    Raises:
        InputError: a file exists there.
    """
    path = Path(value)
    if path.exists() and not overwrite:
        raise InputError(f"{key}={path}: already exists; choose another name, or give overwrite=true to replace it")
    return path


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


def pose2sim_file(recording: Recording, frames: tuple[int, int], actor: str = "") -> Path:
    """Where Pose2Sim's next steps look for the points of a trial; `frames`: first and last."""
    person = f"_{actor}" if actor else ""
    return recording.path / "pose-3d" / f"{recording.name}{person}_{frames[0]}-{frames[1]}.trc"


def check_pose2sim(recording: Recording, frames: tuple[int, int], bodies: Sequence[Body], replaced: bool) -> None:
    """Check that points can be written into a Pose2Sim project; `frames`: first and last.

    Raises:
        InputError: the recording is none, or has them already, or a body lacks one of the points.
    """
    if not (recording.path / CONFIG).is_file():
        raise InputError(f"outputs.pose2sim=true: {recording.path} is no Pose2Sim project (no {CONFIG}); leave it out")
    for body in bodies:
        path = pose2sim_file(recording, frames, body.name if len(bodies) > 1 else "")
        if path.exists() and not replaced:
            raise InputError(f"{path}: already exists; move it away, or give overwrite=true to replace it")
        lacking = set(named_scheme(POSE2SIM_SCHEME).landmarks) - {*body.landmarks.names, *body.skeleton.names}
        if lacking:
            raise InputError(
                f"outputs.pose2sim=true: {body.name} has no landmark {min(lacking)}, one of {POSE2SIM_SCHEME}; leave "
                "it out, or add the landmark to the body file"
            )


def write_results(result: Run, out: Path, wanted: OutputsConfig, config: Any, made_actors: Sequence[Body]) -> None:
    """Write the files that need whole motions; each appears under its name only when complete."""
    with stage(WRITING):
        _write_results(result, out, wanted, config, made_actors)


def _write_results(result: Run, out: Path, wanted: OutputsConfig, config: Any, made_actors: Sequence[Body]) -> None:
    names = list(result.motions)
    streamed, result.files = result.files, []
    for actor in made_actors:
        result.files.append(out / file_name("actor", ".yaml", actor.name, len(made_actors)))
        save_body(result.files[-1], actor)
    for name, motion in result.motions.items():
        result.files.append(out / file_name("motion", ".npz", name, len(names)))
        save_motion(result.files[-1], motion)
        for ending in export_endings(wanted):
            result.files.append(out / file_name("motion", ending, name, len(names)))
            export_motion(motion, result.files[-1])
        if wanted.pose2sim:
            span = int(motion.frame[0]), int(motion.frame[-1])
            path = pose2sim_file(result.recording, span, name if len(names) > 1 else "")
            write_trc(path, motion, motion.up, POSE2SIM_SCHEME)
            say(f"{path}: written for Pose2Sim's next steps")
    with atomic_path(out / "config.yaml") as temporary:
        temporary.write_text(OmegaConf.to_yaml(config))
    result.files.append(out / "config.yaml")
    evaluate(result)
    judge(result)
    write_metrics(out / METRICS, result)
    result.files.append(out / METRICS)
    if not wanted.motion_only and write_worst(out / WORST, result):
        result.files.append(out / WORST)
    result.files += streamed


def actor_name(path: Path, motion: Motion) -> str:
    """Whose motion a file holds: as stated in the file, else by its name (`motion_NAME.npz`)."""
    return motion.actor or path.stem.removeprefix("motion").removeprefix("_") or "actor"


def evaluate(result: Run) -> None:
    """Compare with the ground truth, if there is one."""
    if result.recording.ground_truth is None:
        return
    truth = load_ground_truth(result.recording.ground_truth)
    if len(result.motions) > 1 and not set(result.motions) <= set(truth.subjects):
        say(f"warning: {result.recording.ground_truth} knows {', '.join(truth.subjects)}; nothing was compared")
        return
    try:
        result.evaluation = evaluate_motions(
            result.motions,
            truth,
        )
    except InputError as error:
        say(f"warning: not compared with the truth: {error}")
