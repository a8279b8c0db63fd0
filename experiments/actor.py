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

from sogjax.actor.colors import camera_of
from sogjax.actor.make import MadeActor, make_actor, subjects_of
from sogjax.actor.silhouette_iou import silhouette_iou
from sogjax.data.ground_truth import GroundTruth, load_ground_truth
from sogjax.data.recording import Recording, open_recording
from sogjax.engine.build import energy_terms
from sogjax.engine.recordings import body_named
from sogjax.engine.terminal import say
from sogjax.engine.track import track_recording
from sogjax.evaluate import evaluate_motions
from sogjax.model.body import Body
from sogjax.settings import EnergyConfig
from sogjax.settings.compose import track_config
from sogjax.study.machine import machine_line
from sogjax.study.script import run_script, settings_from
from sogjax.synth import SynthSettings, cached_recording

BONES = {
    "upper arm": ("{side}_shoulder", "{side}_elbow"),
    "forearm": ("{side}_elbow", "{side}_wrist"),
    "thigh": ("{side}_hip", "{side}_knee"),
    "shank": ("{side}_knee", "{side}_ankle"),
    "shoulders": ("left_shoulder", "right_shoulder"),
    "hips": ("left_hip", "right_hip"),
}


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
                recording, body, subjects_of(recording)[0], "hsv_cylinder", energy_terms(EnergyConfig()), say
            )
            print(f"{recording.name:<16}{kind:<10}", *report(recording, made, settings.solver), sep="  ", flush=True)
    print(machine_line())


def report(recording: Recording, made: MadeActor, solver: str) -> list[str]:
    """IoU of silhouettes, errors of bone lengths, and errors of markers and joints."""
    assert recording.ground_truth is not None
    truth = load_ground_truth(recording.ground_truth)
    errors = bone_errors(made.body, truth)
    words = [f"solver={solver}"] if solver else []
    run = track_recording(recording, [made.body], track_config(words, recording=recording.path))
    evaluation = evaluate_motions(run.motions, truth)
    markers = np.concatenate(
        [part.markers.errors.ravel() for part in evaluation.evaluations.values() if part.markers is not None]
    )
    joints = np.concatenate(
        [part.joints.errors.ravel() for part in evaluation.evaluations.values() if part.joints is not None]
    )
    return [
        f"IoU {mean_iou(recording, made):.3f}",
        f"bones {np.mean(np.abs([*errors.values()])):.1f} %",
        "(" + " ".join(f"{name} {error:+.1f}" for name, error in errors.items()) + ")",
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


def bone_errors(body: Body, truth: GroundTruth) -> dict[str, float]:
    """Deviation of each length from the truth's, percent."""
    assert truth.joints is not None
    names = [str(name).split("/")[-1] for name in truth.joint_names]
    sides = {"l_": "left_", "r_": "right_"}
    names = [sides[name[:2]] + name[2:] if name[:2] in sides else name for name in names]
    landmarks = np.asarray(body.posed_landmarks(body.poses["rest"]), float)[None]
    return {
        bone: 100.0 * (_length(landmarks, body.landmarks.names, ends) / _length(truth.joints, names, ends) - 1.0)
        for bone, ends in BONES.items()
    }


def _length(points: np.ndarray, names: list[str] | tuple[str, ...], ends: tuple[str, str]) -> float:
    at = lambda name: points[:, list(names).index(name)]
    return float(
        np.mean(
            [
                np.nanmean(np.linalg.norm(at(ends[0].format(side=side)) - at(ends[1].format(side=side)), axis=-1))
                for side in ("left", "right")
            ]
        )
    )


if __name__ == "__main__":
    run_script(main)
