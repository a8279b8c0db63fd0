"""`sogjax actor`: an actor file from the example poses of a recording, with a report beside it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import yaml

from sogjax.actor.colors import ColoredView, estimated_gains
from sogjax.actor.make import MadeActor
from sogjax.errors import InputError, counted
from sogjax.io.actor_file import save_body
from sogjax.io.files import write_file
from sogjax.io.recording import Recording
from sogjax.model.camera import camera_of
from sogjax.run.actor_report import PAGE, report_folder, write_actor_report
from sogjax.run.actors import ActorRequest, new_actors
from sogjax.run.build import color_space_and_radius
from sogjax.run.recordings import opened
from sogjax.run.run_folder import free_path, results_folder
from sogjax.run.terminal import say
from sogjax.settings.run import ActorConfig

NOTICED = 0.15
"""Logarithm of a camera's gain above which it is reported."""


GOOD_IOU, GOOD_COLORS = 0.75, 0.5
"""Below these an actor must be looked at: agreement with the masks, and what its example poses explain of it."""


def run(config: ActorConfig, name: str | None = None) -> Path:
    """Make the actor and write its report and its file, which comes last: where it is, it is whole.

    Args:
        config: what it is made of, and where to.
        name: of the actor; None: its subject's, or else its body's.

    Raises:
        InputError: an invalid recording, example pose or body, or an actor file that already exists.
    """
    color_space_and_radius(config.color)
    recording = opened(config.recording, config.cameras)
    out = Path(config.out)
    if out.is_dir():
        raise InputError(f"out={out}: is a folder; give the actor file to write, such as out={out / 'actor.yaml'}")
    free_path("out", out, config.overwrite)
    with results_folder(out.parent):
        of_pictures: list[MadeActor] = []
        (actor,) = new_actors(ActorRequest.from_config(recording, config), of_pictures.extend).bodies
        if not of_pictures:
            save_body(out, replace(actor, name=name or actor.name))
            print(out)
            return out
        made, folder = of_pictures[0], report_folder(out)
        if name is not None:
            made = replace(made, body=replace(made.body, name=name), upright_body=replace(made.upright_body, name=name))
        report = write_actor_report(folder, made, recording.rig)
        say_gains(recording, made, folder)
        save_body(out, made.body)
    print(f"silhouettes and masks agree to {report.mean_iou:.3f} (mean IoU)")
    if report.warnings:
        say(f"{counted(len(report.warnings), 'warning')}: see {folder / PAGE}")
    for note in report.notes:
        say(f"note: {note}")
    print(out)
    print(folder / PAGE)
    others = len(report.warnings) - len(made.doubtful)
    print(f"\nverdict: {actor_verdict(report.mean_iou, float(made.body.explained), made.doubtful, others)}")
    return out


def actor_verdict(mean_iou: float, explained: float, doubtful: Sequence[str], num_others: int) -> str:
    """What is thought of an actor, from what its own example poses show.

    Args:
        mean_iou: how well masks and silhouettes agree, 0 to 1.
        explained: how much of it shows its own colours, 0 to 1.
        doubtful: what is doubtful of it, one sentence each.
        num_others: how many other warnings its report has.
    """
    found = [*doubtful]
    if mean_iou < GOOD_IOU and not doubtful:
        found.append(f"silhouettes agree to {mean_iou:.0%} only (80 % and more is usual): look at its report")
    if explained < GOOD_COLORS:
        found.append(
            f"its example poses explain {explained:.0%} of it only (60 to 75 % is usual): look at the colours "
            "in its report"
        )
    if num_others:
        found.append(f"{counted(num_others, 'more warning' if doubtful else 'warning')} in its report")
    return "; ".join(found) or f"looks right (its example poses explain {explained:.0%} of it)"


def say_gains(recording: Recording, made: MadeActor, folder: Path) -> None:
    """Write color_gains.yaml, and report cameras that show the actor's colours differently."""
    names, rig = recording.rig.names, jax.tree.map(jnp.asarray, recording.rig.cameras)
    views: dict[int, list[ColoredView]] = {}
    for posed, pose in zip(made.pictures, made.example_poses.values(), strict=True):
        for camera, image in posed.images.items():
            views.setdefault(camera, []).append(ColoredView(camera_of(rig, camera), image, posed.masks[camera], pose))
    found = estimated_gains(made.upright_body, views)
    total = {names[camera]: gains * recording.color_gains.get(names[camera], 1.0) for camera, gains in found.items()}
    rounded = {name: [round(float(gain), 3) for gain in gains] for name, gains in total.items()}
    write_file(
        folder / "color_gains.yaml", yaml.safe_dump({"color_gains": rounded}, default_flow_style=None, sort_keys=False)
    )
    unlike = {names[camera]: gains for camera, gains in found.items() if np.abs(np.log(gains)).max() > NOTICED}
    if unlike:
        worst = max(unlike, key=lambda name: float(np.abs(np.log(unlike[name])).max()))
        factors = " ".join(f"{gain:.2f}" for gain in unlike[worst])
        say(
            f"in {len(unlike)} of {counted(len(found), 'camera')} the subject's colours differ from "
            f"the other cameras' (most in {worst}: red, green, blue must be multiplied by {factors}); this may "
            "be shading; if the cameras differ in exposure or white balance, copy color_gains of "
            f"{folder / 'color_gains.yaml'} into recording.yaml and make the actor again"
        )
