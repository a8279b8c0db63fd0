"""A recording as a Pose2Sim project, with simulated keypoints where a motion has its joints.

    python experiments/pose2sim_project.py recording=FOLDER motion=FOLDER/motion.npz out=PROJECT

Writes Config.toml, calibration/, links to the videos in videos/, and pose/CAMERA_json/ as Pose2Sim's pose estimation
does. Nothing hides a keypoint; the settings that begin with `keypoint` are those of `sogjax synth`. Then

    sogjax check recording=PROJECT
    sogjax track recording=PROJECT out=RESULTS
    sogjax export motion=RESULTS/motion.npz to=PROJECT/pose-3d/NAME.trc markers=HALPE_26
"""

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from omegaconf import MISSING

from sogjax.errors import InputError
from sogjax.io.calibration.tables import write_toml
from sogjax.io.keypoints.scheme import KeypointScheme
from sogjax.io.keypoints.write import pictures_to_write, write_pose2sim
from sogjax.io.motion import Motion, load_motion
from sogjax.io.recording import Recording
from sogjax.run.recordings import opened
from sogjax.study.script import run_script, settings_from
from sogjax.synth.detector import DetectorSettings, Sight
from sogjax.synth.keypoints import files_there, found_in, scheme_of
from sogjax.synth.landmarks import KEYPOINTS
from sogjax.view.projection import picture_points


@dataclass
class Settings(DetectorSettings):
    """What is written, as `key=value` on the command line."""

    keypoints: str = "pose2sim"
    recording: str = MISSING
    motion: str = MISSING
    """Of one actor in the recording."""
    out: str = MISSING
    """A new folder."""
    seed: int = 0


def main() -> None:
    """Write the project."""
    settings = settings_from(Settings)
    recording, motion, out = opened(settings.recording), load_motion(Path(settings.motion)), Path(settings.out)
    if out.exists():
        raise InputError(f"out={out}: is there already; choose a new folder")
    detector = DetectorSettings(**{entry.name: getattr(settings, entry.name) for entry in fields(DetectorSettings)})
    detector.check()
    scheme = scheme_of(detector)
    cameras = range(len(recording.rig))
    pictures = [_pictures(recording, motion, camera, scheme, detector, settings.seed) for camera in cameras]
    (out / "videos").mkdir(parents=True)
    (out / "Config.toml").write_text(f"[project]\nframe_rate = {recording.fps}\nframe_range = 'all'\n")
    write_toml(out / "calibration" / "Calib.toml", recording.rig)
    for name, of_camera in zip(recording.rig.names, pictures, strict=True):
        source = recording.sources[name].resolve()
        (out / "videos" / source.name).symlink_to(source)
        write_pose2sim(out / "pose", name, of_camera)
    print(out)


def _pictures(
    recording: Recording, motion: Motion, camera: int, scheme: KeypointScheme, detector: DetectorSettings, seed: int
) -> list[np.ndarray | None]:
    """What the detector finds in the images of a camera's file; no file where the motion has no pose."""
    name = recording.rig.names[camera]
    points = np.stack([motion.joint(landmark) for landmark in KEYPOINTS], axis=1)
    pixels, depths = picture_points(recording.rig.select([name]), points)
    size, focal = np.array(recording.rig.image_size(name)), float(recording.rig.camera(name).intrinsics[1, 1])
    inside = np.isfinite(pixels[0]).all(-1) & (pixels[0] >= 0).all(-1) & (pixels[0] < size).all(-1)
    stature = float(np.ptp(points[0], axis=0).max())
    pictures: list[np.ndarray | None] = [None] * recording.num_images[name]
    there = files_there(detector, seed, camera, len(pictures))
    for row, frame in enumerate(motion.frame.tolist()):
        image = frame + recording.frame_offset[name]
        height = np.array([focal * stature / max(float(depths[0, row].mean()), 0.1)])
        where = np.nan_to_num(pixels[0, row]).astype(float)[None]
        sight = Sight(where, inside[row][None], np.zeros((1, len(KEYPOINTS)), bool), height)
        found = found_in(sight, scheme, detector, seed, camera, frame)
        if there[image]:
            pictures[image] = pictures_to_write(scheme, found[None], np.ones(1, bool))[0]
    return pictures


if __name__ == "__main__":
    run_script(main)
