"""Folders as Pose2Sim and FreeMoCap leave them."""

import numpy as np
from keypoint_cases import people, write_keypoints
from small_recording import toml_camera, write_calibration, write_video

from sogjax.io.keypoints.scheme import named_scheme

CAMERAS = ("cam01", "cam02")


def pose2sim(folder, config="[project]\nframe_rate = 'auto'\n"):
    """A project as Pose2Sim makes it: a calibration named after its folders of pictures, RTMPose's keypoints."""
    (folder / "calibration").mkdir(parents=True)
    (folder / "Config.toml").write_text(config)
    tables = [toml_camera(f"int_{name}_img") for name in CAMERAS]
    written = write_calibration(folder / "calibration", *tables, "[metadata]\nadjusted = false\nerror = 0.0\n")
    written.rename(folder / "calibration/Calib_scene.toml")
    (folder / "calibration/Calib.qca.txt").write_text("<calibration/>")
    for index, name in enumerate(CAMERAS):
        write_video(folder / "videos" / f"{name}.mp4", index)
    return folder, write_keypoints(folder / "pose", "pose2sim", cameras=CAMERAS)


def freemocap(folder, ground_plane="true"):
    """A recording as FreeMoCap leaves it; millimetres."""
    names = ("Camera_000", "Camera_001")
    folder.mkdir(parents=True)
    tables = [
        toml_camera(f"cam_{k}", name=f'"{name}"', translation="[100.0, 200.0, 3000.0]") for k, name in enumerate(names)
    ]
    metadata = f"[metadata]\ncharuco_square_size = 39.0\ngroundplane_calibration = {ground_plane}\n"
    write_calibration(folder, *tables, metadata).rename(folder / "walk_camera_calibration.toml")
    for index, name in enumerate(names):
        write_video(folder / "synchronized_videos" / f"{name}_synchronized.mp4", index)
        write_video(folder / "annotated_videos" / f"{name}_annotated.mp4", index)
    scheme = named_scheme("MEDIAPIPE_33")
    array = np.full((2, 4, 553, 2), np.nan)
    array[:, :, list(scheme.indices)] = people(scheme)[None, :, 0, :, :2]
    place = folder / "output_data/raw_data/mediapipe_2dData_numCams_numFrames_numTrackedPoints_pixelXY.npy"
    place.parent.mkdir(parents=True)
    np.save(place, array)
    return folder
