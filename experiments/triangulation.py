"""How far do keypoints alone come, without a body model?

    python experiments/triangulation.py [cameras=[2,3,4,6,12]] [sequences=[walk,run]] [keypoint_noise=10]

Simulated keypoints of every yardstick sequence are triangulated as Pose2Sim does: weighted by confidence, cameras that
disagree left out; then gaps are filled and all is filtered (6 Hz). With recording=FOLDER, keypoints and truth of that
folder. The settings that begin with `keypoint` are those of `sogjax synth`. Keypoints that were simulated are kept.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields

import numpy as np

from sogjax.errors import InputError
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.keypoints.load import Keypoints, load_keypoints
from sogjax.io.recording import Recording
from sogjax.run.recordings import opened
from sogjax.run.terminal import progress, say
from sogjax.study.experiment import Experiment, synth_settings
from sogjax.study.few_cameras import evenly
from sogjax.study.script import machine_line, run_script, settings_from
from sogjax.study.triangulation_trials import JointErrors, triangulation_errors
from sogjax.synth.cache import cached_keypoints, cached_recording
from sogjax.synth.detector import DetectorSettings


def together(rows: Sequence[JointErrors]) -> JointErrors:
    """Several recordings in one row: means, and the sum of the lost stretches."""
    mean = lambda name: float(np.mean([getattr(row, name) for row in rows]))
    lost, joints = sum(row.lost for row in rows), min(row.joints for row in rows)
    return JointErrors(mean("found"), mean("missing"), mean("filtered"), mean("worst"), lost, joints)


FRAMES = 60


@dataclass
class Settings(DetectorSettings):
    """What is triangulated, as `key=value` on the command line."""

    keypoints: str = "pose2sim"
    sequences: list[str] = field(default_factory=list)
    """Rows of the experiment `sequences`; none: all."""
    recording: str = ""
    """A folder with keypoints and ground truth, instead of them."""
    cameras: list[int] = field(default_factory=lambda: [2, 3, 4, 6, 12])


def main() -> None:
    """Triangulate, and print the table."""
    settings = settings_from(Settings)
    print(machine_line())
    print("\n| recording | cameras | found, mm | missing | filled and filtered, mm | 95 %, mm | lost | joints |")
    print("|---" * 8 + "|")
    total: dict[int, list[JointErrors]] = {}
    for name, (recording, keypoints) in _recordings(settings).items():
        for warning in keypoints.warnings:
            say(warning)
        if recording.ground_truth is None:
            raise InputError(f"{recording.path}: has no ground_truth.npz; give a recording with ground truth")
        truth = load_ground_truth(recording.ground_truth)
        for count in settings.cameras:
            if count <= len(recording.rig):
                errors = triangulation_errors(recording, keypoints, truth, evenly(recording.rig.names, count))
                total.setdefault(count, []).append(errors)
                print(_row(name, count, errors), flush=True)
    for count, rows in total.items():
        print(_row("all", count, together(rows)))


def _recordings(settings: Settings) -> dict[str, tuple[Recording, Keypoints]]:
    if settings.recording:
        recording = opened(settings.recording)
        keypoints = load_keypoints(recording, scheme=settings.keypoint_scheme)
        if keypoints is None:
            raise InputError(f"{recording.path}: has no keypoints; put them into keypoints/CAMERA")
        return {recording.name: (recording, keypoints)}
    rows = Experiment.named("sequences").config.rows
    whole = {name: row.synth for name, row in rows.items() if row.synth is not None and row.methods is None}
    unknown = [name for name in settings.sequences if name not in whole]
    if unknown:
        raise InputError(f"sequences: {unknown[0]}: is none of {', '.join(whole)}")
    return {name: _simulated(settings, whole[name]) for name in settings.sequences or whole}


def _simulated(settings: Settings, synth: dict[str, object]) -> tuple[Recording, Keypoints]:
    wanted = synth_settings({"frames": FRAMES, **synth})
    detector = DetectorSettings(**{entry.name: getattr(settings, entry.name) for entry in fields(DetectorSettings)})
    recording = opened(str(cached_recording(wanted, progress=progress)))
    keypoints = load_keypoints(recording, cached_keypoints(wanted, detector), settings.keypoint_scheme)
    assert keypoints is not None
    return recording, keypoints


def _row(name: str, count: int, errors: JointErrors) -> str:
    figures = (
        f"{1e3 * errors.found:.1f} | {100 * errors.missing:.1f} % | {1e3 * errors.filtered:.1f} | "
        f"{1e3 * errors.worst:.1f} | {errors.lost} | {errors.joints}"
    )
    return f"| {name} | {count} | {figures} |"


if __name__ == "__main__":
    run_script(main)
