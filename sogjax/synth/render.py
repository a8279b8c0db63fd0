"""Renders a whole recording with its ground truth into a folder."""

import shutil
import uuid
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import yaml

from sogjax.errors import InputError
from sogjax.io.calibration.rig import CameraEntry, rig_from_entries
from sogjax.io.calibration.tables import write_toml
from sogjax.io.ground_truth import GroundTruth, save_ground_truth
from sogjax.io.recording_files import CALIBRATION, GROUND_TRUTH, INITIAL_POSE, SETTINGS
from sogjax.synth.anatomy import Pose
from sogjax.synth.detector import DetectorSettings
from sogjax.synth.exercises import EXAMPLE_POSES
from sogjax.synth.filming import example_folder, film_all, num_pictures, num_workers
from sogjax.synth.keypoints import keypoint_folder, write_simulated
from sogjax.synth.landmarks import LANDMARKS, MARKERS, landmark_points, marker_vertices
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import Stage, stage_of
from sogjax.synth.true_angles import true_angles

Progress = Callable[[Iterable, int, str], Iterable]
"""Wraps an iterable, given its length and a label, and yields the same."""


def silent(items: Iterable, total: int, label: str) -> Iterable:
    """No progress bar."""
    return items


def render_recording(
    settings: SynthSettings,
    out: Path,
    progress: Progress = silent,
    workers: int | None = None,
    detector: DetectorSettings | None = None,
) -> Path:
    """Render a recording into the folder `out`, which appears when it is whole.

    Args:
        settings: what to render; the same settings give the same pictures, bit for bit.
        out: a folder that does not exist yet, or is empty.
        progress: wraps the pictures to count them.
        workers: processes to use; by default one per core, and one for short recordings.
        detector: what finds keypoints in the pictures; None: nothing does.

    Raises:
        InputError: a setting is wrong, or `out` cannot be used.
    """
    settings.check()
    out = Path(out)
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        remedy = "choose another, or give overwrite=true to replace it"
        raise InputError(f"out={out}: exists and is not empty; {remedy}")
    stage = stage_of(settings)
    temporary = out.with_name(f".{out.name[:80]}.{uuid.uuid4().hex[:8]}.tmp")
    try:
        temporary.mkdir(parents=True)
    except OSError as error:
        raise InputError(f"out={out}: its folder cannot be written ({error.strerror}); choose another") from error
    try:
        _write_descriptions(stage, temporary)
        if detector is not None and detector.keypoints != "none":
            write_simulated(stage, detector, temporary / keypoint_folder(detector))
        pictures = num_pictures(settings)
        workers = workers or num_workers(pictures, settings.cameras)
        for _ in progress(film_all(stage, temporary, workers), pictures, "rendering"):
            pass
        for log in temporary.glob(".worker_*.log"):
            log.unlink()
        if out.exists():
            out.rmdir()
        temporary.rename(out)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return out


def _write_descriptions(stage: Stage, folder: Path) -> None:
    """Write everything but the pictures."""
    entries = [
        CameraEntry(
            name=view.name,
            intrinsics=view.matrix,
            rotation=view.camera_from_world[:3, :3],
            translation=view.camera_from_world[:3, 3],
            distortion=view.distortion,
            size=(view.width, view.height),
        )
        for view in stage.views
    ]
    write_toml(CALIBRATION.of(folder), rig_from_entries(CALIBRATION.of(folder), entries))
    save_ground_truth(GROUND_TRUTH.of(folder), ground_truth_of(stage))
    rough = [_rough(stage, actor, 0, stage.poses(0)[actor]) for actor in range(stage.settings.actors)]
    several = dict(zip(stage.settings.actor_names, rough, strict=True))
    _write_yaml(INITIAL_POSE.of(folder), rough[0] if len(rough) == 1 else several)
    _write_yaml(SETTINGS.of(folder), _description(stage))


def _description(stage: Stage) -> dict:
    settings = stage.settings
    description: dict = {"fps": settings.fps, "calibration": CALIBRATION.name, "unit": "m", "up": "z"}
    if settings.example_poses:
        description["example_poses"] = [
            {
                "name": example_folder(stage, actor, pose),
                "actor": settings.actor_names[actor],
                "initial_pose": _rough(stage, actor, 1 + number, stage.example_pose(actor, pose)),
            }
            for actor in range(settings.actors)
            for number, pose in enumerate(EXAMPLE_POSES)
        ]
    return description


def ground_truth_of(stage: Stage) -> GroundTruth:
    """True markers, joints and joint angles of every frame."""
    several = stage.settings.actors > 1
    prefixes = [f"{name}/" if several else "" for name in stage.settings.actor_names]
    vertices = [marker_vertices(person) for person in stage.people]
    markers, joints = [], []
    for frame in range(stage.settings.frames):
        poses = stage.poses(frame)
        placed = list(zip(stage.people, poses, vertices, strict=True))
        markers.append(np.concatenate([person.posed(pose).vertices[v] for person, pose, v in placed]))
        joints.append(np.concatenate([landmark_points(p.anatomy, pose) for p, pose, _ in placed]))
    angles, angle_names = true_angles([each.anatomy for each in stage.people], stage.poses, prefixes, len(joints))
    return GroundTruth(
        fps=stage.settings.fps,
        markers=np.stack(markers),
        marker_names=tuple(prefix + name for prefix in prefixes for name in MARKERS),
        joints=np.stack(joints),
        joint_names=tuple(prefix + name for prefix in prefixes for name in LANDMARKS),
        angles=angles,
        angle_names=angle_names,
    )


def _rough(stage: Stage, actor: int, number: int, pose: Pose) -> dict:
    """Landmarks as a person would read them off, as plain YAML: 25 mm off, standard deviation on each axis."""
    rng = np.random.default_rng([stage.settings.seed, 8, actor, number])
    points = landmark_points(stage.people[actor].anatomy, pose)
    points = points + 0.025 * rng.standard_normal(points.shape)
    return {"landmarks": {name: np.round(p, 3).tolist() for name, p in zip(LANDMARKS, points, strict=True)}}


def _write_yaml(path: Path, content: dict) -> None:
    path.write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None), encoding="utf-8")
