"""A subject that is no person goes through the same commands: a drawn dog, from files to files."""

import numpy as np
import pytest
from body_cases import posed, shipped
from command_line import done
from drawn_scene import draw, in_colors, moved, standing
from rig_cases import ring_rig
from small_recording import write_image

from sogjax.io.actor_file import load_body
from sogjax.io.calibration.tables import write_toml
from sogjax.io.ground_truth import GroundTruth, load_ground_truth, save_ground_truth
from sogjax.io.motion import load_motion
from sogjax.io.recording import open_recording
from sogjax.run.background import Background
from sogjax.run.clip_search import ClipSearch
from sogjax.run.initial_pose import ELSEWHERE
from sogjax.run.track import opened_clip
from sogjax.settings.compose import track_config

FRAMES = 12
HEIGHT = 1.1
"""Metres: the cameras look at 1.2."""
NOTHING_SHOWN = ("outputs.overlay=false", "outputs.rerun=false", "outputs.page=false")


def trotting(dog, frame):
    """Legs that swing in pairs while the dog goes forward, 2 cm a frame."""
    swing = 0.3 * np.sin(0.5 * frame)
    changes = {"root_x": 0.02 * frame, "root_yaw": 0.5, "neck_bend": 0.3}
    changes |= {"left_front_swing": swing, "right_hip_bend": swing}
    changes |= {"right_front_swing": -swing, "left_hip_bend": -swing}
    return moved(dog, standing(dog, HEIGHT), changes)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Pictures of five cameras, and an example pose with masks."""
    folder = tmp_path_factory.mktemp("dogs") / "trot"
    dog, rig = in_colors(shipped("dog")), ring_rig(5, (320, 240), distance=1.8)
    poses = [trotting(dog, frame) for frame in range(FRAMES)]
    for frame, pose in enumerate(poses):
        for name, image in zip(rig.names, draw(dog, pose, rig), strict=True):
            write_image(folder / "images" / name / f"{frame:06d}.png", image)
    views = zip(rig.names, draw(dog, poses[0], rig), draw(dog, poses[0], rig, masks=True), strict=True)
    for name, image, mask in views:
        write_image(folder / "example_poses" / "stand" / f"{name}.png", image)
        write_image(folder / "example_poses" / "stand" / f"{name}.mask.png", mask.astype(np.uint8) * 255)
    write_toml(folder / "calibration.toml", rig)
    (folder / "recording.yaml").write_text("fps: 25\nup: z\n")
    points = np.stack([np.asarray(posed(dog, pose)[1], float) for pose in poses])
    save_ground_truth(folder / "ground_truth.npz", GroundTruth(25.0, points, dog.landmarks.names))
    return folder


@pytest.mark.slow
def test_a_dog_is_tracked_by_the_commands_from_files_alone(recording, tmp_path, capsys):
    """The body is asked for by name, made from its pictures, found in frame 0 and followed."""
    actor, out = tmp_path / "dog.yaml", tmp_path / "out"
    done(capsys, "actor", f"recording={recording}", "body=dog", f"out={actor}")
    assert (tmp_path / "dog_report" / "index.html").is_file()
    done(capsys, "track", f"recording={recording}", f"actor={actor}", f"out={out}", *NOTHING_SHOWN)
    motion = load_motion(out / "motion.npz")
    assert len(motion.frame) == FRAMES
    assert (out / "motion.bvh").is_file()
    truth = load_ground_truth(recording / "ground_truth.npz")
    body = load_body(actor)
    found = np.stack([np.asarray(posed(body, pose.astype(np.float32))[1], float) for pose in motion.pose])
    assert np.linalg.norm(found - truth.markers, axis=-1).mean() < 0.04
    text, _ = done(capsys, "evaluate", f"motion={out}/motion.npz", f"truth={recording}/ground_truth.npz")
    assert "all markers" in text


@pytest.mark.slow
@pytest.mark.parametrize(("off", "warned"), [(0.1, False), (1.6, True)])
def test_a_rough_pose_beside_the_dog_is_doubted_at_once(recording, off, warned):
    dog = in_colors(shipped("dog"))
    clip = opened_clip(open_recording(recording), track_config((), recording="r"))
    search = ClipSearch(clip, Background(None), [dog], track_config((), recording="r"))
    (away,) = search.away(0, [np.asarray(moved(dog, trotting(dog, 0), {"root_x": off}))])
    assert (away > ELSEWHERE) == warned
