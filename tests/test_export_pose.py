"""A frame of a motion as `initial_pose.yaml`: read again, it is the pose that was written."""

import numpy as np
import pytest
import yaml
from body_cases import shipped
from command_line import done, refused

from sogjax.io.motion import motion_from_poses
from sogjax.io.motion_data import save_motion
from sogjax.io.pose_description import load_initial_poses
from sogjax.search.described_pose import described_pose

TOLERANCE = 1e-4


@pytest.fixture(scope="module")
def body():
    return shipped("human")


@pytest.fixture(scope="module")
def motion(body):
    rng = np.random.default_rng(3)
    poses = (
        np.asarray(body.poses["rest"])[None] + rng.normal(size=(4, len(body.poses["rest"]))).astype(np.float32) * 0.3
    )
    motion = motion_from_poses(body, poses, 25.0, frame=np.arange(4) + 10)
    motion.actor = "anna"
    return motion


def test_the_pose_of_a_frame_comes_back(capsys, tmp_path, body, motion):
    save_motion(tmp_path / "motion.npz", motion)
    to = tmp_path / "initial_pose.yaml"
    done(capsys, "export", f"motion={tmp_path / 'motion.npz'}", "frame=12", f"to={to}")
    found = described_pose(body, load_initial_poses(to, ["anna"])["anna"], "z")
    np.testing.assert_allclose(np.asarray(found), motion.pose[2], atol=TOLERANCE)


def test_several_actors_make_a_mapping(capsys, tmp_path, motion):
    for name in ("anna", "ben"):
        motion.actor = name
        save_motion(tmp_path / f"motion_{name}.npz", motion)
    files = [str(tmp_path / f"motion_{name}.npz") for name in ("anna", "ben")]
    to = tmp_path / "initial_pose.yaml"
    done(capsys, "export", f"motion=[{','.join(files)}]", f"to={to}")
    assert list(yaml.safe_load(to.read_text())) == ["anna", "ben"]
    assert "holds one motion" in refused(capsys, "export", f"motion=[{','.join(files)}]", f"to={tmp_path / 'a.bvh'}")


def test_a_frame_that_is_not_there_and_one_of_another_format_are_refused(capsys, tmp_path, motion):
    save_motion(tmp_path / "motion.npz", motion)
    words = ("export", f"motion={tmp_path / 'motion.npz'}")
    assert "10 to 13" in refused(capsys, *words, "frame=3", f"to={tmp_path / 'initial_pose.yaml'}")
    assert "only a .yaml" in refused(capsys, *words, "frame=12", f"to={tmp_path / 'a.bvh'}")
    assert not (tmp_path / "initial_pose.yaml").exists()
