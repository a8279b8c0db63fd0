"""How much better is an estimated actor than the default body scaled as a whole?

    python experiments/actor.py [recordings=[FOLDER,...]] [motions=[walk]] [solver=gauss_newton]

Both are made from the same example poses and coloured alike; then the recording is tracked with each. Bone lengths are
compared with the distances of the truth's joints: upper arm, forearm, thigh, shank (left and right together), shoulder
and hip width.
"""

from dataclasses import dataclass, field, replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np

from sogjax.actor.coverage import silhouette_iou
from sogjax.actor.make import MadeActor, make_actor, subjects_of
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.recording import Recording, open_recording
from sogjax.model.camera import camera_of
from sogjax.quality.evaluation import evaluate_motions
from sogjax.quality.metrics import bone_errors
from sogjax.run.build import energy_terms
from sogjax.run.recordings import body_named
from sogjax.run.terminal import say
from sogjax.run.track import track_recording
from sogjax.settings.compose import track_config
from sogjax.settings.method import EnergyConfig
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.synth.cache import cached_recording
from sogjax.synth.settings import SynthSettings


@dataclass
class Settings:
    """What is compared."""

    recordings: list[str] = field(default_factory=list)
    motions: list[str] = field(default_factory=lambda: ["walk"])
    solver: str = ""
    """Empty: the default one."""


def main() -> None:
    """Print a few lines for each recording."""
    settings = settings_from(Settings)
    folders = [Path(folder) for folder in settings.recordings]
    folders += [cached_recording(SynthSettings(motion)) for motion in settings.motions]
    for folder in folders:
        recording = open_recording(folder)
        for kind, body in (
            ("scaled", replace(body_named("human"), shape_groups=())),
            ("estimated", body_named("human")),
        ):
            made = make_actor(
                recording, body, subjects_of(recording)[0], "hsv_shaded", energy_terms(EnergyConfig()), say
            )
            print(f"{recording.name:<16}{kind:<10}", *report(recording, made, settings.solver), sep="  ", flush=True)
    print(machine_line())


def report(recording: Recording, made: MadeActor, solver: str) -> list[str]:
    """IoU of silhouettes, errors of bone lengths, and errors of markers and joints."""
    assert recording.ground_truth is not None
    truth = load_ground_truth(recording.ground_truth)
    errors = bone_errors(made.body, truth)
    words = [f"solver={solver}"] if solver else []
    run = track_recording(recording, [made.body], track_config(words, recording=recording.path)).result_so_far
    evaluation = evaluate_motions(run.motions, truth)
    markers = np.concatenate(
        [part.markers.errors.ravel() for part in evaluation.evaluations.values() if part.markers is not None]
    )
    joints = np.concatenate(
        [part.joints.errors.ravel() for part in evaluation.evaluations.values() if part.joints is not None]
    )
    return [
        f"IoU {mean_iou(recording, made):.3f}",
        f"bones {100.0 * np.mean(np.abs([*errors.values()])):.1f} %",
        "(" + " ".join(f"{name} {100.0 * error:+.1f}" for name, error in errors.items()) + ")",
        f"markers {1000 * np.nanmean(markers):.1f} +- {1000 * np.nanstd(markers):.1f} mm",
        f"joints {1000 * np.nanmean(joints):.1f} mm",
    ]


def mean_iou(recording: Recording, made: MadeActor) -> float:
    """Over all example poses and cameras."""
    rig = jax.tree.map(jnp.asarray, recording.rig.cameras)
    return float(
        np.mean(
            [
                silhouette_iou(made.upright_body, pose, camera_of(rig, camera), mask)
                for posed, pose in zip(made.pictures, made.example_poses.values(), strict=True)
                for camera, mask in posed.masks.items()
            ]
        )
    )


if __name__ == "__main__":
    run_script(main)
