"""`sogjax actor`: an actor file from the example poses of a recording, and a report beside it."""

from pathlib import Path

from sogjax.actor.make import make_actor
from sogjax.app.actor_report import report_folder, write_actor_report
from sogjax.app.build import color_space_and_radius, energy_weights
from sogjax.app.configs import ActorConfig
from sogjax.app.outputs import free_path, results_folder
from sogjax.app.progress import progress
from sogjax.app.recordings import body_named, opened, say
from sogjax.data.actor_file import save_body
from sogjax.errors import InputError


def run(config: ActorConfig) -> Path:
    """Make the actor and write its file and its report.

    Raises:
        InputError: anything wrong with the recording, its example poses or the body, or an actor file that is there.
    """
    space, _ = color_space_and_radius(config.color)
    weights = energy_weights(config.energy)
    recording = opened(config.recording, config.cameras)
    body = body_named(config.body)
    out = Path(config.out)
    if out.is_dir():
        raise InputError(f"out={out}: is a folder; give the actor file to write, such as out={out / 'actor.yaml'}")
    free_path("out", out, config.overwrite)
    with results_folder(out.parent):
        made = make_actor(recording, body, config.subject, space, weights, say, progress, config.symmetric)
        save_body(out, made.body)
        folder = report_folder(out)
        report = write_actor_report(folder, made, recording.rig)
    print(f"silhouettes and masks agree to {report.mean_iou:.3f} (mean IoU)")
    if report.warnings:
        say(f"{len(report.warnings)} warnings: see {folder / 'report.md'}")
    print(out)
    print(folder / "report.md")
    return out
