"""Every reader of files with a good file, for `fuzzing.py`."""

from collections.abc import Callable
from pathlib import Path

import calibration_cases
import jax.numpy as jnp
import numpy as np
import skeleton_cases
from bad_inputs import make_workplace
from keypoint_cases import write_keypoints

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.array_log import ArrayLog
from sogjax.io.calibration.load import load_calibration
from sogjax.io.cell_cache import cell_cache
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.image_file import read_image, read_mask
from sogjax.io.initial_pose import load_initial_poses
from sogjax.io.keypoints.camera_keypoints import read_camera, read_keypoint_array
from sogjax.io.keypoints.scheme import load_scheme
from sogjax.io.motion import load_motion
from sogjax.io.motion_log import MotionLog
from sogjax.io.recording import open_recording
from sogjax.io.recording_settings import read_recording_settings
from sogjax.io.skeletons.load import read_skeleton
from sogjax.io.skeletons.skeletool_motion import read_skeletool_motion
from sogjax.io.source import look_at_source, open_source
from sogjax.run.kept_run import FOLDER, NOTE, KeptRun
from sogjax.run.prefix import CAPACITIES, CAPACITY, COLUMNS, TERM, Prefix

Read = Callable[[Path], object]

CALIBRATIONS = {"Skeletool": "rig.calibration", "Qualisys": "rig.qca.txt", "Panoptic": "rig.json"}
CELLS = np.arange(4 * 3 * 6 * 8 * 3, dtype=np.uint8).reshape(4, 3, 6, 8, 3)
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
    """What a run that did not end leaves: its motion so far, and what it needs to go on."""
    with_motion, kept = MotionLog(place / "motion.partial"), KeptRun(place)
    motion = load_motion(place / "motion.npz")
    with_motion.append(motion)
    with_motion.close()
    kept.begin("track", {"version": "1"})
    kept.keep_actors([load_body(place / "actor.yaml")])
    kept.keep_start(jnp.asarray(motion.pose[0]), 0)
    names = (*COLUMNS, f"{TERM}similarity", *(CAPACITY.format(name) for name in CAPACITIES))
    rows = dict.fromkeys(names, motion.iterations) | {"pose": motion.pose}
    ArrayLog(kept.folder, {}, rows).close()
    kept.settle(Prefix(rows))
    kept.keep_sampled({0: jnp.asarray(motion.pose[0])})
    whole_motion = lambda path: load_motion(path.parent)
    return {
        "motion.partial, rows.npy": (place / "motion.partial/rows.npy", whole_motion),
        "motion.partial, constant.npz": (place / "motion.partial/constant.npz", whole_motion),
        "run.partial, run.json": (place / FOLDER / NOTE, lambda _: kept.note or _refused()),
        "run.partial, rows.npy": (place / FOLDER / "rows.npy", lambda _: kept.prefix(4, 4) or _refused()),
        "run.partial, settled.npz": (place / FOLDER / "settled.npz", lambda _: kept.settled(4) or _refused()),
        "run.partial, sampled.npz": (place / FOLDER / "sampled.npz", lambda _: kept.sampled() or _refused()),
        "run.partial, start.npz": (place / FOLDER / "start.npz", lambda _: kept.start()),
        "run.partial, actors.npz": (place / FOLDER / "actors.npz", lambda _: kept.actors()),
        "run.partial, actor_0.yaml": (place / FOLDER / "actor_0.yaml", lambda _: kept.actors()),
    }


def _pictures(place: Path) -> dict[str, tuple[Path, Read]]:
    walk, tpose = place / "walk", place / "walk/example_poses/tpose"
    array, _, find_array = _kept_cells(place / "cells")
    _, note, find_note = _kept_cells(place / "other_cells")
    return {
        "video, mp4": (walk / "videos/left.mp4", read_video),
        "picture, jpg": (tpose / "left.jpg", read_image),
        "mask, png": (tpose / "left.mask.png", read_mask),
        "kept cells, npy": (array, find_array),
        "kept cells, json": (note, find_note),
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
    cache = cell_cache(str(folder), open_recording(folder.parent / "walk"), 4, lambda sentence: None)
    list(cache.kept(0, len(CELLS), iter(CELLS), lambda cells: cells))
    (array,), (note,) = cache.folder.glob("*.npy"), cache.folder.glob("*.json")
    good = {path: path.read_bytes() for path in (array, note)}

    def found(path: Path) -> object:
        other = note if path == array else array
        other.write_bytes(good[other])  # a cache removes both where one is damaged
        cells = cache.find(0, len(CELLS))
        if cells is not None and not np.array_equal(cells, CELLS):
            raise AssertionError("other cells than those that were kept")
        return _refused() if cells is None else cells

    return array, note, found


def _refused() -> None:
    """Readers whose caller makes the thing anew say so by nothing."""
    raise InputError("is made anew")
