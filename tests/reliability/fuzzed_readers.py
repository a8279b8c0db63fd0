"""Every reader of files with a good file, for `fuzzing.py`."""

from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import calibration_cases
import numpy as np
import skeleton_cases
from bad_inputs import make_workplace
from keypoint_cases import write_keypoints

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.calibration.load import load_calibration
from sogjax.io.cell_store import CELLS, CellStore
from sogjax.io.cell_store import FRAMES as KEPT
from sogjax.io.frame_motions import FRAMES, ClipFacts, load_one_motion
from sogjax.io.frame_table import FrameLog, FrameTable, read_frames_log
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.image_file import read_image, read_mask
from sogjax.io.keypoints.camera_keypoints import read_camera, read_keypoint_array
from sogjax.io.keypoints.scheme import load_scheme
from sogjax.io.motion import Motion, load_motion
from sogjax.io.pose_description import load_initial_poses
from sogjax.io.recording import open_recording
from sogjax.io.recording_settings import read_recording_settings
from sogjax.io.skeletons.load import read_skeleton
from sogjax.io.skeletons.skeletool import read_skeletool_motion
from sogjax.io.source import look_at_source, open_source
from sogjax.run.actors import Actors
from sogjax.run.background import Background
from sogjax.run.initial_pose import InitialPose
from sogjax.run.learn_occluders import LearntOccluders
from sogjax.run.merge import Merged
from sogjax.run.run_files import KEPT as PARTIAL
from sogjax.run.run_files import NOTE
from sogjax.run.run_folder import read_note, write_note
from sogjax.scene.background import BackgroundImage

Read = Callable[[Path], object]

CALIBRATIONS = {"Skeletool": "rig.calibration", "Qualisys": "rig.qca.txt", "Panoptic": "rig.json"}
SEEN = np.arange(4 * 3 * 6 * 8 * 3, dtype=np.uint8).reshape(4, 3, 6, 8, 3)
"""Kept cells of the workplace's recording."""


def readers(place: Path) -> dict[str, tuple[Path, Read]]:
    """By name: a good file in `place`, where it is written now, and what reads it."""
    make_workplace(place)
    files = _recordings(place) | _calibrations(place) | _skeletons(place) | _keypoints(place)
    return files | _runs(place) | _pictures(place)


def _recordings(place: Path) -> dict[str, tuple[Path, Read]]:
    return {
        "recording.yaml": (place / "walk/recording.yaml", read_recording_settings),
        "initial_pose.yaml": (place / "walk/initial_pose.yaml", lambda path: load_initial_poses(path, ["puppet"])),
        "actor.yaml": (place / "actor.yaml", load_body),
        "motion.npz": (place / "motion.npz", load_motion),
        "ground_truth.npz": (place / "truth.npz", load_ground_truth),
    }


def _calibrations(place: Path) -> dict[str, tuple[Path, Read]]:
    intri = calibration_cases.write(place / "easymocap", "EasyMocap")
    files = {"TOML": place / "walk/calibration.toml", "EasyMocap intri.yml": intri}
    files["EasyMocap extri.yml"] = intri.with_name("extri.yml")
    files |= {kind: calibration_cases.write(place / kind, kind, name) for kind, name in CALIBRATIONS.items()}
    return {f"calibration, {kind}": (path, load_calibration) for kind, path in files.items()}


def _skeletons(place: Path) -> dict[str, tuple[Path, Read]]:
    texts = {
        "its.skeleton": skeleton_cases.skeleton_text(),
        "good.skeleton": skeleton_cases.skeleton_text(),
        "its.dof": skeleton_cases.DOF_TEXT,
        "its.bvh": skeleton_cases.BVH,
        "its.motion": skeleton_cases.MOTION,
    }
    for name, text in texts.items():
        (place / name).write_bytes(text.encode())
    skeleton = place / "good.skeleton"
    body = read_skeleton(skeleton)
    return {
        "skeleton, Skeletool .skeleton": (place / "its.skeleton", read_skeleton),
        "skeleton, Skeletool .dof": (place / "its.dof", lambda path: read_skeleton(skeleton, path)),
        "skeleton, hierarchy of a BVH": (place / "its.bvh", lambda path: read_skeleton(path, unit="cm")),
        "motion, Skeletool .motion": (place / "its.motion", lambda path: read_skeletool_motion(path, body, 25.0)),
    }


def _keypoints(place: Path) -> dict[str, tuple[Path, Read]]:
    found: dict[str, tuple[Path, Read]] = {}
    for program in ("openpose", "mmpose", "alphapose"):
        write_keypoints(place / program, program, cameras=("a",), scheme="COCO_17", frames=1)
        found[f"keypoints, {program}"] = (next((place / program).rglob("*.json")), read_camera)
    write_keypoints(place / "mediapipe", "mediapipe", cameras=("a",))
    found["keypoints, npy"] = (place / "mediapipe/a.npy", read_keypoint_array)
    scheme = place / "scheme.yaml"
    scheme.write_text("name: A\ncount: 2\nkeypoints:\n  - {name: N, index: 1, landmark: nose, within: 0.03}\n")
    return found | {"keypoints, scheme": (scheme, load_scheme)}


def _runs(place: Path) -> dict[str, tuple[Path, Read]]:
    """What a run that did not end leaves: the records of its passes, and the log of its frames."""
    kept, motion = PARTIAL.of(place), load_motion(place / "motion.npz")
    recording = open_recording(place / "walk")
    write_note(NOTE.of(kept), {"command": "track", "origin": {"version": "1"}})
    Actors((load_body(place / "actor.yaml"),)).save(kept)
    InitialPose(0, motion.pose[0], "file").save(kept)
    Background((BackgroundImage.nothing(8, 6),) * 2).save(kept)
    LearntOccluders(np.ones((2, 6, 8)), (3, 9)).save(kept)
    ClipFacts.of(recording).save(kept)
    table = _table(motion)
    with FrameLog(kept / FRAMES) as log:
        log.append(table)
    Merged(table).save(kept)
    so_far = lambda path: load_one_motion(kept)
    loads = {
        "run.json": lambda _: read_note(NOTE.of(kept)) or _refused(),
        "frames/rows.npy": lambda _: read_frames_log(kept / FRAMES) or _refused(),
        "clip.json": so_far,
        "actors.npz": lambda _: Actors.load(kept),
        "actor_0.yaml": lambda _: Actors.load(kept),
        "initial_pose.npz": lambda _: InitialPose.load(kept),
        "background.npz": lambda _: Background.load(kept),
        "occluders.npz": lambda _: LearntOccluders.load(kept),
        "merged.npz": lambda _: Merged.load(kept),
    }
    return {f"run.partial, {name}": (kept / name, read) for name, read in loads.items()}


def _table(motion: Motion) -> FrameTable:
    """A run's rows with the poses of a motion."""
    count = motion.num_frames
    known = {"frame": motion.frame, "pose": motion.pose, "energy": motion.energy, "iterations": motion.iterations}
    views = {name: np.zeros((count, 2), int) for name in ("num_near", "num_matching")}
    capacities = np.full((count, 3), 256)
    rest = {"evaluations": motion.iterations, "converged": motion.converged, "num_blocks": np.zeros(count, int)}
    return FrameTable(**known, **rest, **views, capacities=capacities, terms={"similarity": motion.similarity})


def _pictures(place: Path) -> dict[str, tuple[Path, Read]]:
    walk, tpose = place / "walk", place / "walk/example_poses/tpose"
    cells, _, find_cells = _kept_cells(place / "cells")
    _, frames, find_frames = _kept_cells(place / "other_cells")
    return {
        "video, mp4": (walk / "videos/left.mp4", read_video),
        "picture, jpg": (tpose / "left.jpg", read_image),
        "mask, png": (tpose / "left.mask.png", read_mask),
        "kept cells": (cells, find_cells),
        "kept cells, which are there": (frames, find_frames),
    }


def read_video(path: Path) -> list[np.ndarray]:
    """All images of a video, looked at first as a recording's are."""
    look_at_source(path)
    source = open_source(path)
    try:
        images = []
        while (image := source.read()) is not None:
            images.append(image)
    finally:
        source.close()
    return images


def _kept_cells(folder: Path) -> tuple[Path, Path, Read]:
    """The two files of kept cells, and what finds them: cells that are not those that were kept are a bug."""
    recording = open_recording(folder.parent / "walk")
    store = CellStore(folder, recording, 4, SEEN.shape[1:4], lambda sentence: None)
    present = np.ones(SEEN.shape[1], bool)
    for frame, cells in enumerate(SEEN):
        store.keep(frame, cells, present)
    store.close()

    def found(path: Path) -> object:
        with closing(store):
            for frame in np.flatnonzero(store.kept(range(len(SEEN)))).tolist():
                if (kept := store.find(frame)) is not None and not np.array_equal(kept[0], SEEN[frame]):
                    raise AssertionError("other cells than those that were kept")
        return store

    return folder / CELLS, folder / KEPT, found


def _refused() -> None:
    """Readers whose caller makes the thing anew say so by nothing."""
    raise InputError("is made anew")
