"""What a run leaves in its folder: motion, configuration, metrics, overlay video, Rerun file, BVH."""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np
from omegaconf import OmegaConf

from sogjax.app.configs import OutputsConfig
from sogjax.app.progress import progress
from sogjax.app.recordings import say
from sogjax.data.actor_file import save_body
from sogjax.data.atomic import atomic_path
from sogjax.data.export import export_motion
from sogjax.data.ground_truth import load_ground_truth
from sogjax.data.motion import save_motion
from sogjax.data.recording import Recording
from sogjax.data.video import read_frames
from sogjax.errors import InputError
from sogjax.evaluate import evaluate_motions
from sogjax.model.body import Body

if TYPE_CHECKING:
    from sogjax.app.track import Run


@contextmanager
def results_folder(path: Path) -> Iterator[Path]:
    """The folder for results, made if it is not there; found out before the work begins, not after.

    When the work ends with an error, the folders made for it are removed, unless there is something in them.

    Raises:
        InputError: it cannot be made or written.
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


def file_name(stem: str, ending: str, actor: str, num_actors: int) -> str:
    """`motion.npz`, or with several actors `motion_NAME.npz`."""
    return f"{stem}{ending}" if num_actors == 1 else f"{stem}_{actor}{ending}"


def write_results(result: Run, out: Path, wanted: OutputsConfig, config: Any, made_actors: Sequence[Body]) -> None:
    """Write everything; each file appears under its name only when it is whole."""
    names = list(result.motions)
    for actor in made_actors:
        result.files.append(out / file_name("actor", ".yaml", actor.name, len(made_actors)))
        save_body(result.files[-1], actor)
    for name, motion in result.motions.items():
        result.files.append(out / file_name("motion", ".npz", name, len(names)))
        save_motion(result.files[-1], motion)
        if wanted.bvh:
            result.files.append(out / file_name("motion", ".bvh", name, len(names)))
            export_motion(motion, result.files[-1], up=result.recording.up)
    with atomic_path(out / "config.yaml") as temporary:
        temporary.write_text(OmegaConf.to_yaml(config))
    result.files.append(out / "config.yaml")
    evaluate(result, out)
    if wanted.overlay:
        write_overlay_video(result, out / "overlay.mp4", wanted.overlay_width)
    if wanted.rerun:
        write_rerun_file(result, out / "motion.rrd", wanted.rerun_images)


def evaluate(result: Run, out: Path) -> None:
    """Compare with the ground truth, where there is one, and write metrics.json."""
    if result.recording.ground_truth is None:
        return
    truth = load_ground_truth(result.recording.ground_truth)
    if len(result.motions) > 1 and not set(result.motions) <= set(truth.subjects):
        say(f"warning: {result.recording.ground_truth} knows {', '.join(truth.subjects)}; nothing is compared")
        return
    try:
        result.evaluation = evaluate_motions(result.motions, truth)
    except InputError as error:
        say(f"warning: nothing is compared: {error}")
        return
    result.evaluation.to_json(out / "metrics.json")
    result.files.append(out / "metrics.json")


def write_overlay_video(result: Run, path: Path, width: int) -> None:
    """The skeletons on every camera's pictures."""
    from sogjax.view.overlay import write_overlay

    write_overlay(path, result.recording, list(result.motions.values()), width=width, progress=progress)
    result.files.append(path)


def write_rerun_file(result: Run, path: Path, with_images: bool) -> None:
    """Cameras, pictures, image blobs, bodies and the terms of the energy, for the Rerun viewer."""
    from sogjax.view.rerun import write_rerun

    motions = list(result.motions.values())
    terms = [frame.result.terms for frame in result.frames]
    truth = None if result.recording.ground_truth is None else load_ground_truth(result.recording.ground_truth)
    write_rerun(
        path,
        result.recording,
        motions,
        names=list(result.motions),
        frames=_pictures(result.recording, motions) if with_images else None,
        image_blobs=_image_blobs(result),
        blob_colors=[np.asarray(body.blob_colors, np.float32) for body in result.bodies],
        terms={
            "limit_penalty": np.array([float(t.limit_penalty) for t in terms]),
            "acceleration_penalty": np.array([float(t.acceleration_penalty) for t in terms]),
        },
        truth=truth,
        progress=progress,
    )
    result.files.append(path)


def _pictures(recording: Recording, motions: Sequence[Any]) -> Iterator[list[np.ndarray]]:
    first = int(motions[0].frame[0]) - recording.first_frame
    return read_frames(recording, first, first + len(motions[0].frame))


def _image_blobs(result: Run) -> Iterator[list[Any]]:
    """The image blobs that each frame used, in sRGB."""
    from sogjax.model.color import to_rgb
    from sogjax.view.rerun import ImageBlobs

    for frame in result.frames:
        images = frame.result.images
        rgb = np.asarray(to_rgb(jnp.asarray(images.colors), frame.color_space))
        masks = np.asarray(images.mask)
        yield [
            ImageBlobs(np.asarray(images.means[c])[mask], np.asarray(images.sigmas[c])[mask], rgb[c][mask])
            for c, mask in enumerate(masks)
        ]
