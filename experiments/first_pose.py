"""How far off is the first pose that is found without a hint?

For every motion and seed the actors are made from their example poses, and frame 0 is searched.

    python experiments/first_pose.py seeds=10 motions=[walk,arms,squat_kick,cartwheel,pass]
"""

from dataclasses import dataclass, field

import numpy as np

from sogjax.data.ground_truth import load_ground_truth
from sogjax.data.motion import motion_from_poses
from sogjax.engine.first_pose import searched_poses
from sogjax.engine.recordings import actors_of, opened, upright
from sogjax.evaluation.markers import joint_errors
from sogjax.settings.compose import track_config
from sogjax.study.machine import machine_line
from sogjax.study.script import run_script, settings_from
from sogjax.synth import SynthSettings, cached_recording
from sogjax.synth.settings import MOTIONS

ALLOWED = 0.06
"""Metres."""


@dataclass
class Settings:
    """What is tried."""

    motions: list[str] = field(default_factory=lambda: list(MOTIONS))
    seeds: int = 10
    frames: int = 2
    cameras: int = 12
    plates: bool = True


def main() -> None:
    """Print one line per recording and actor, then a summary."""
    settings = settings_from(Settings)
    errors = []
    for motion in settings.motions:
        for seed in range(settings.seeds):
            errors += errors_of(motion, seed, settings)
    millimetres = 1000.0 * np.array(errors)
    good = int(np.sum(millimetres <= 1000.0 * ALLOWED))
    print(
        f"{good} of {len(errors)} within {1000.0 * ALLOWED:.0f} mm; "
        f"median {np.median(millimetres):.1f} mm, worst {millimetres.max():.1f} mm"
    )
    print(machine_line())


def errors_of(motion: str, seed: int, settings: Settings) -> list[float]:
    """Mean distance of the joints from the truth in frame 0 (metres), for every actor."""
    actors = 2 if motion == "pass" else 1
    folder = cached_recording(
        SynthSettings(motion=motion, actors=actors, seed=seed, frames=settings.frames, cameras=settings.cameras)
    )
    config = track_config(recording=folder, images={"use_plates": settings.plates})
    recording = opened(str(folder))
    bodies, _ = actors_of(recording, None, config.body, config.color)
    bodies = [upright(body, recording) for body in bodies]
    truth = load_ground_truth(folder / "ground_truth.npz")
    errors = []
    for body, found in zip(bodies, searched_poses(recording, bodies, config, 0), strict=True):
        motion_of_one = motion_from_poses(body, found.pose[None], recording.fps)
        of_body = truth.subject(body.name) if actors > 1 else truth
        distances = joint_errors(motion_of_one, of_body)
        assert distances is not None
        errors.append(float(np.nanmean(distances.errors)))
        line = f"{motion:<10} seed {seed} {body.name:<5} {1000.0 * errors[-1]:7.1f} mm"
        print(f"{line}, margin {100.0 * found.margin:.1f} %", flush=True)
    return errors


if __name__ == "__main__":
    run_script(main)
