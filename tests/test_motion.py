"""Motions follow from the poses, survive their file, and are refused where they are wrong."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tiny_body import make_body, random_poses

from sogjax.errors import InputError
from sogjax.io.motion import Motion, load_motion, motion_from_poses
from sogjax.io.motion_data import save_motion

BODY = make_body()
METRES = 1e-5


@pytest.fixture(scope="module")
def motion():
    return motion_from_poses(
        BODY, random_poses(BODY, 5), 50.0, frame=np.arange(5) * 2 + 7, energy=np.linspace(0.0, 1.0, 5)
    )


@pytest.fixture
def saved(motion, tmp_path):
    path = tmp_path / "motion.npz"
    save_motion(path, motion)
    return path


def chained(body, pose):
    """Forward kinematics, joint by joint, with scipy's rotations."""
    skeleton, frames = body.skeleton, []
    params = np.asarray(skeleton.parameter_transform, float) @ pose
    for joint, parent in enumerate(skeleton.parents):
        axis, local = np.asarray(skeleton.axes[joint], float), np.eye(4)
        local[:3, 3] = np.asarray(skeleton.offsets[joint])
        if skeleton.revolute[joint]:
            local[:3, :3] = Rotation.from_rotvec(params[joint] * axis).as_matrix()
        else:
            local[:3, 3] += params[joint] * axis
        frames.append(local if parent < 0 else frames[parent] @ local)
    return params, np.array(frames)


def test_a_motion_is_the_bodys_kinematics_in_every_frame(motion):
    for t, pose in enumerate(random_poses(BODY, 5)):
        params, frames = chained(BODY, pose)
        np.testing.assert_allclose(motion.joint_params[t], params, atol=METRES)
        np.testing.assert_allclose(motion.world_from_joint[t], frames, atol=METRES)
        hand = frames[BODY.blobs.joints[1]] @ [0.0, 0.25, 0.0, 1.0]
        np.testing.assert_allclose(motion.blob_means[t, 1], hand[:3], atol=METRES)
    np.testing.assert_allclose(motion.time, np.array([7, 9, 11, 13, 15]) / 50.0)
    assert motion.joint_names.tolist() == list(BODY.skeleton.names)
    assert np.isnan(motion.similarity).all()
    assert motion.converged.all()


def test_a_motion_survives_its_file(motion, saved):
    again = load_motion(saved)
    for name, value in vars(motion).items():
        np.testing.assert_array_equal(getattr(again, name), value)
    with np.load(saved) as arrays:
        assert arrays["format_version"] == 1


def test_no_frames_and_no_blobs_are_a_motion_too(tmp_path):
    empty = motion_from_poses(BODY, np.zeros((0, BODY.skeleton.num_dofs)), 50.0)
    save_motion(tmp_path / "empty.npz", empty)
    assert load_motion(tmp_path / "empty.npz").num_frames == 0


def test_poses_on_the_device_are_as_good_as_numpys():
    motion = motion_from_poses(BODY, jnp.zeros((2, BODY.skeleton.num_dofs)), 25.0)
    assert isinstance(motion, Motion)
    known = {name: value for name, value in vars(motion).items() if value is not None}
    assert all(isinstance(value, np.ndarray | float | str) for value in known.values())
    assert vars(motion).keys() - known.keys() == {
        *("limb_names", "joint_limb", "limb_doubt", "limb_hidden", "explained", "overlap", "camera_names"),
        *("unfiltered_pose", "limb_unlike", "limb_rival"),
    }


def test_doubts_about_limbs_are_kept_and_files_without_them_are_read(tmp_path):
    plain = motion_from_poses(BODY, np.zeros((3, BODY.skeleton.num_dofs)), 25.0)
    assert "limb_doubt" not in np.load(_saved(tmp_path / "plain.npz", plain))
    assert load_motion(tmp_path / "plain.npz").limb_doubt is None
    doubt, of_joint = np.linspace(0.0, 1.0, 6).reshape(3, 2), np.full(BODY.skeleton.num_joints, -1)
    of_joint[-1] = 1
    judged = replace(plain, limb_names=np.array(["arm", "leg"]), joint_limb=of_joint, limb_doubt=doubt)
    found = load_motion(_saved(tmp_path / "judged.npz", judged))
    np.testing.assert_array_equal(found.limb_doubt, doubt)
    assert found.limb_names.tolist() == ["arm", "leg"]
    rival = np.where(doubt > 0.5, np.nan, -0.01)  # none was searched
    found = load_motion(_saved(tmp_path / "rivals.npz", replace(judged, limb_unlike=0.5 * doubt, limb_rival=rival)))
    np.testing.assert_array_equal(found.limb_unlike, 0.5 * doubt)
    np.testing.assert_array_equal(found.limb_rival, rival)
    arrays = dict(np.load(tmp_path / "judged.npz"))
    wrong = {"limb_doubt": (doubt[:, 1:], "'limb_doubt' has the shape"), "joint_limb": (of_joint + 1, "holds 2")}
    for name, (array, sentence) in wrong.items():
        np.savez(tmp_path / "wrong.npz", **arrays | {name: array})
        with pytest.raises(InputError, match=sentence):
            load_motion(tmp_path / "wrong.npz")


def _saved(path, motion):
    save_motion(path, motion)
    return path


def with_nan(values):
    values = values.astype(float)
    values.flat[3] = np.nan
    return values


@pytest.mark.parametrize(
    ("key", "change", "message"),
    [
        ("pose", None, "no array 'pose'"),
        ("format_version", None, "no array 'format_version'"),
        ("format_version", lambda _: np.array(2), "version 2"),
        ("fps", lambda _: np.array(np.nan), "fps.*nan"),
        ("fps", lambda _: np.array(-1.0), "-1"),
        ("fps", lambda _: np.array([25.0]), r"\(1,\)"),
        ("fps", lambda _: np.array("fast"), "number"),
        ("pose", with_nan, r"'pose' is nan at \(0, 3\)"),
        ("world_from_joint", with_nan, "nan"),
        ("world_from_joint", lambda a: a * 2.0, "no rotations"),
        ("world_from_joint", lambda a: a[:, :, :3], r"'world_from_joint'.*\(5, 16, 3, 4\)"),
        ("pose", lambda a: a[:4], r"'pose'.*\(4, 16\)"),
        ("dof_names", lambda a: a[:4], r"'pose'.*should be \(5, 4\)"),
        ("dof_names", lambda a: np.arange(16), "'dof_names'.*text"),
        ("blob_means", lambda a: a.astype(str), "'blob_means'.*numbers"),
        ("blob_joint", lambda a: a + 100, "'blob_joint'.*107"),
        ("joint_parents", lambda a: a + 1, "'joint_parents' gives root_tx the parent 0"),
        ("joint_parents", lambda a: a.astype(float), "whole numbers"),
        ("frame", lambda a: a[::-1], "'frame' does not increase"),
        ("energy", lambda a: np.full(5, np.inf), "'energy' is infinite"),
        ("converged", lambda a: np.full(5, 2.0), "'converged'"),
        ("joint_names", lambda a: a.astype(object), "pickle"),
    ],
)
def test_a_wrong_array_is_named(saved, key, change, message):
    with np.load(saved) as file:
        arrays = dict(file)
    value = arrays.pop(key)
    if change is not None:
        arrays[key] = change(value)
    np.savez(saved, **arrays)
    with pytest.raises(InputError, match=message) as error:
        load_motion(saved)
    assert str(saved) in str(error.value)


@pytest.mark.parametrize("content", [b"", b"no zip", b"PK\x03\x04 broken"])
def test_a_file_that_is_no_npz(tmp_path, content):
    path = tmp_path / "motion.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"motion\.npz: is not readable as npz"):
        load_motion(path)
    with pytest.raises(InputError, match="no such file"):
        load_motion(tmp_path / "absent.npz")


def test_half_a_file_and_one_with_broken_bytes_are_refused(saved):
    whole = saved.read_bytes()
    for content in (whole[: len(whole) // 2], whole[:200] + b"\xff" * 100 + whole[300:]):
        saved.write_bytes(content)
        with pytest.raises(InputError, match=r"motion\.npz"):
            load_motion(saved)


def test_numbers_beyond_all_rotations_are_refused_without_a_warning(saved):
    with np.load(saved) as kept:
        arrays = dict(kept)
    arrays["world_from_joint"][0, 0, :3, :3] = np.array([[1e30, -1e30, 0.0], [1e30, 1e30, 0.0], [0.0, 0.0, 1.0]])
    np.savez(saved, **arrays)
    with pytest.raises(InputError, match="no rotations"):
        load_motion(saved)
