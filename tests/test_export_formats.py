"""What other libraries read from TRC, C3D, GLB and CSV is the motion, to a tenth of a millimetre."""

import csv
import dataclasses
import sys

import ezc3d
import numpy as np
import pygltflib
import pytest
from body_cases import shipped
from command_line import done, refused
from scipy.spatial.transform import Rotation
from test_bvh import BONES, y_up
from tiny_body import make_body, random_poses

from sogjax.errors import InputError
from sogjax.io.export.bones import bones_of
from sogjax.io.export.points import OPENSIM_NAMES
from sogjax.io.export.write import WRITERS, export_motion
from sogjax.io.motion import load_motion, motion_from_poses
from sogjax.io.motion_data import per_frame_fields, save_motion

BODY = make_body()
METRES = 1e-4
UPS = ("z", "y", "-y")


@pytest.fixture(scope="module")
def motion():
    return motion_from_poses(BODY, random_poses(BODY, 6, seed=3), 25.0, frame=np.arange(6) * 2 + 4, up="y")


def joint_positions(motion, bone):
    index = motion.joint_names.tolist().index(BONES[bone])
    return motion.world_from_joint[:, index, :3, 3]


@pytest.mark.parametrize("up", UPS)
def test_trc(motion, tmp_path, up):
    export_motion(motion, tmp_path / "walk.trc", up)
    lines = [line.split("\t") for line in (tmp_path / "walk.trc").read_text().splitlines()]
    assert lines[0] == ["PathFileType", "4", "(X/Y/Z)", "walk.trc"]
    facts = dict(zip(lines[1], lines[2], strict=True))
    assert (facts["Units"], facts["NumFrames"], facts["NumMarkers"]) == ("m", "6", "8")
    assert float(facts["DataRate"]) == float(facts["CameraRate"]) == 12.5
    names = [name for name in lines[3][2:] if name]
    assert lines[4][2:5] == ["X1", "Y1", "Z1"]
    assert lines[5] == [""]
    table = np.array(lines[6:], float)
    np.testing.assert_allclose(table[:, 0], motion.frame)
    np.testing.assert_allclose(table[:, 1], motion.time, atol=1e-6)
    ours = {"Hip": "root", "LShoulder": "left_shoulder", "LElbow": "left_elbow", "Neck": "neck", "LHip": "left_hip"}
    assert set(ours) < set(names)
    for column, name in enumerate(names):
        expected = y_up(joint_positions(motion, ours.get(name, name)), up)
        np.testing.assert_allclose(table[:, 2 + 3 * column : 5 + 3 * column], expected, atol=METRES)


def test_the_names_that_opensim_knows_are_those_of_the_default_body(tmp_path):
    body = shipped("human")
    motion = motion_from_poses(body, np.zeros((1, body.skeleton.num_dofs)), 30.0)
    export_motion(motion, tmp_path / "rest.trc")
    names = (tmp_path / "rest.trc").read_text().splitlines()[3].split("\t")
    both = [side + joint for side in "LR" for joint in ("Hip", "Knee", "Ankle", "Shoulder", "Elbow", "Wrist")]
    assert {"Hip", "Neck", *both} <= set(names)


@pytest.mark.parametrize("up", UPS)
def test_trc_with_pose2sims_markers(capsys, tmp_path, up):
    body = shipped("human")
    poses = np.random.default_rng(0).normal(0.0, 0.3, (5, body.skeleton.num_dofs))
    motion = dataclasses.replace(motion_from_poses(body, poses, 30.0), up=up)
    save_motion(tmp_path / "motion.npz", motion)
    path = tmp_path / "pose-3d" / "trial_0-4.trc"
    done(capsys, "export", f"motion={tmp_path / 'motion.npz'}", f"to={path}", "markers=HALPE_26")
    # As Pose2Sim reads it: five lines of header, names in every third column, then numbers.
    with path.open() as file:
        header = [next(file).rstrip("\n").split("\t") for _ in range(5)]
        table = np.loadtxt(file, delimiter="\t")
    names = [name for name in header[3][2::3] if name.strip()]
    assert {"Hip", "Neck", "Head", "Nose", "RBigToe", "LHeel", "LSmallToe", "RWrist"} <= set(names)
    assert len(names) == 26
    points = table[:, 2:].reshape(5, 26, 3)
    for name, landmark in {"Hip": "pelvis", "RHeel": "right_heel", "LKnee": "left_knee", "Head": "head_top"}.items():
        np.testing.assert_allclose(points[:, names.index(name)], y_up(motion.joint(landmark), up), atol=METRES)


def test_markers_are_for_trc_and_of_a_known_scheme(capsys, tmp_path, motion):
    save_motion(tmp_path / "motion.npz", motion)
    source = f"motion={tmp_path / 'motion.npz'}"
    assert "markers=HALPE_26" in refused(capsys, "export", source, f"to={tmp_path / 'a.bvh'}", "markers=HALPE_26")
    assert "'HALPE'" in refused(capsys, "export", source, f"to={tmp_path / 'a.trc'}", "markers=HALPE")
    assert "landmark 'nose'" in refused(capsys, "export", source, f"to={tmp_path / 'a.trc'}", "markers=HALPE_26")
    assert not [*tmp_path.glob("a.*")]


@pytest.mark.parametrize("up", UPS)
def test_csv(motion, tmp_path, up):
    export_motion(motion, tmp_path / "walk.csv", up)
    with (tmp_path / "walk.csv").open(newline="") as file:
        assert next(file) == f"# unit: m, time: s, up: {up}\n"
        rows = list(csv.DictReader(file))
    np.testing.assert_array_equal([int(row["frame"]) for row in rows], motion.frame)
    np.testing.assert_allclose([float(row["time"]) for row in rows], motion.time, atol=1e-6)
    for bone in BONES:
        read = [[float(row[f"{bone}.{axis}"]) for axis in "xyz"] for row in rows]
        np.testing.assert_allclose(read, joint_positions(motion, bone), atol=METRES)


@pytest.mark.parametrize(("up", "screen"), [("z", ("+X", "+Z")), ("y", ("+Z", "+Y")), ("-y", ("+Z", "-Y"))])
def test_c3d(motion, tmp_path, up, screen):
    export_motion(motion, tmp_path / "walk.c3d", up)
    read = ezc3d.c3d(str(tmp_path / "walk.c3d"))
    parameters = read["parameters"]["POINT"]
    assert parameters["UNITS"]["value"] == ["mm"]
    assert (parameters["X_SCREEN"]["value"], parameters["Y_SCREEN"]["value"]) == ([screen[0]], [screen[1]])
    assert parameters["RATE"]["value"] == [12.5]
    points = read["data"]["points"]
    assert points.shape == (4, len(BONES), 6)
    ours = {name: bone for bone, name in OPENSIM_NAMES.items()}
    for index, name in enumerate(parameters["LABELS"]["value"]):
        expected = joint_positions(motion, ours.get(name, name))
        np.testing.assert_allclose(points[:3, index].T / 1000.0, expected, atol=METRES)


def test_c3d_without_ezc3d(motion, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    with pytest.raises(InputError, match=r"walk\.c3d.*ezc3d.*sogjax\[export\]"):
        export_motion(motion, tmp_path / "walk.c3d")
    assert not (tmp_path / "walk.c3d").exists()


def test_more_frames_than_c3d_can_count(motion, tmp_path):
    rows = {name: rows for name in per_frame_fields() if (rows := getattr(motion, name)) is not None}
    rows = {name: np.resize(values, (65_536, *values.shape[1:])) for name, values in rows.items()}
    long = dataclasses.replace(motion, **rows | {"frame": np.arange(65_536)})
    with pytest.raises(InputError, match=r"65535 frames.*65536.*\.trc"):
        export_motion(long, tmp_path / "a.c3d")


def values(gltf, index):
    """The numbers of an accessor, as pygltflib's tree describes them."""
    accessor = gltf.accessors[index]
    view = gltf.bufferViews[accessor.bufferView]
    assert view.byteOffset % 4 == 0
    blob = gltf.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    dtype = {pygltflib.FLOAT: "<f4", pygltflib.UNSIGNED_SHORT: "<u2", pygltflib.UNSIGNED_INT: "<u4"}
    array = np.frombuffer(blob, dtype[accessor.componentType]).reshape(accessor.count, -1)
    if accessor.min:
        np.testing.assert_allclose(array.min(axis=0), accessor.min)
        np.testing.assert_allclose(array.max(axis=0), accessor.max)
    return array.astype(float) if accessor.componentType == pygltflib.FLOAT else array


def node_frames(gltf):
    """By node the world transforms in every frame, composed from the tracks."""
    animation = gltf.animations[0]
    tracks = {}
    for channel in animation.channels:
        sampler = animation.samplers[channel.sampler]
        tracks[channel.target.node, channel.target.path] = values(gltf, sampler.output)
    times = values(gltf, animation.samplers[0].input)[:, 0]
    parents = {child: k for k, node in enumerate(gltf.nodes) for child in node.children or []}

    def world(node):
        local = np.tile(np.eye(4), (len(times), 1, 1))
        local[:, :3, :3] = Rotation.from_quat(tracks[node, "rotation"]).as_matrix()
        local[:, :3, 3] = tracks.get((node, "translation"), np.array(gltf.nodes[node].translation))
        return world(parents[node]) @ local if node in parents else local

    return {gltf.nodes[k].name: world(k) for k, _ in tracks}, times


@pytest.mark.parametrize("up", UPS)
def test_glb(motion, tmp_path, up):
    export_motion(motion, tmp_path / "walk.glb", up)
    gltf = pygltflib.GLTF2().load(str(tmp_path / "walk.glb"))
    assert gltf.asset.extras == {"unit": "m", "up": "y", "fps": 25.0}
    frames, times = node_frames(gltf)
    np.testing.assert_allclose(times, np.arange(6) * 2 / 25.0, atol=1e-6)
    assert set(frames) == set(BONES)
    for bone in BONES:
        np.testing.assert_allclose(frames[bone][:, :3, 3], y_up(joint_positions(motion, bone), up), atol=METRES)


def test_the_skin_of_a_glb_shows_the_blobs_in_every_frame(motion, tmp_path):
    export_motion(motion, tmp_path / "walk.glb")
    gltf = pygltflib.GLTF2().load(str(tmp_path / "walk.glb"))
    frames, _ = node_frames(gltf)
    skin, primitive = gltf.skins[0], gltf.meshes[0].primitives[0]
    bind = values(gltf, skin.inverseBindMatrices).reshape(-1, 4, 4).swapaxes(1, 2)
    moved = np.stack([frames[gltf.nodes[joint].name] @ bind[k] for k, joint in enumerate(skin.joints)], axis=1)
    corners = values(gltf, primitive.attributes.POSITION)
    joints = values(gltf, primitive.attributes.JOINTS_0)
    np.testing.assert_allclose(values(gltf, primitive.attributes.WEIGHTS_0), [[1, 0, 0, 0]] * len(corners))
    assert values(gltf, primitive.indices).max() == len(corners) - 1
    homogeneous = np.concatenate([corners, np.ones((len(corners), 1))], axis=1)
    shown = np.einsum("tnij,nj->tni", moved[:, joints[:, 0]], homogeneous)[..., :3]
    centres = shown.reshape(6, -1, 6, 3).mean(axis=2)
    np.testing.assert_allclose(centres, y_up(motion.blob_means, "y"), atol=METRES)
    sizes = np.linalg.norm(shown.reshape(6, -1, 6, 3) - centres[:, :, None], axis=-1)
    np.testing.assert_allclose(sizes, np.broadcast_to(1.35 * motion.blob_sigma[:, None], sizes.shape), atol=METRES)


def test_quaternions_of_a_glb_do_not_jump(tmp_path):
    poses = np.zeros((80, BODY.skeleton.num_dofs))
    poses[:, BODY.skeleton.dof_names.index("root_rz")] = np.linspace(0.0, 6.0 * np.pi, 80)
    export_motion(motion_from_poses(BODY, poses, 25.0), tmp_path / "turn.glb")
    gltf = pygltflib.GLTF2().load(str(tmp_path / "turn.glb"))
    rotation = values(gltf, gltf.animations[0].samplers[0].output)
    assert (np.sum(rotation[1:] * rotation[:-1], axis=1) > 0.9).all()


def test_the_vertical_is_the_motions_unless_given(motion, tmp_path):
    export_motion(motion, tmp_path / "said.trc")
    export_motion(motion, tmp_path / "given.trc", "y")
    said, given = ((tmp_path / f"{name}.trc").read_text().splitlines()[3:] for name in ("said", "given"))
    assert said == given
    export_motion(motion, tmp_path / "turned.npz", "-y")
    assert load_motion(tmp_path / "turned.npz").up == "-y"


def test_the_vertical_survives_files_and_is_z_in_older_ones(motion, tmp_path):
    save_motion(tmp_path / "motion.npz", motion)
    assert load_motion(tmp_path / "motion.npz").up == "y"
    with np.load(tmp_path / "motion.npz") as file:
        arrays = dict(file)
    del arrays["up"]
    np.savez(tmp_path / "older.npz", **arrays)
    assert load_motion(tmp_path / "older.npz").up == "z"
    np.savez(tmp_path / "wrong.npz", **arrays, up="w")
    with pytest.raises(InputError, match=r"'up' is 'w'.*-y"):
        load_motion(tmp_path / "wrong.npz")


@pytest.mark.parametrize("ending", ["trc", "c3d"])
def test_formats_with_one_rate_want_even_frames(motion, tmp_path, ending):
    uneven = dataclasses.replace(motion, frame=np.array([0, 1, 2, 3, 4, 9]))
    with pytest.raises(InputError, match=f"{ending.upper()} needs evenly spaced frames"):
        export_motion(uneven, tmp_path / f"a.{ending}")
    for other in ("glb", "csv"):
        export_motion(uneven, tmp_path / f"a.{other}")


@pytest.mark.parametrize("ending", ["trc", "c3d", "glb", "bvh"])
def test_no_frames_are_refused_and_leave_nothing(tmp_path, ending):
    empty = motion_from_poses(BODY, np.zeros((0, BODY.skeleton.num_dofs)), 25.0)
    with pytest.raises(InputError, match="no frames"):
        export_motion(empty, tmp_path / f"a.{ending}")
    assert list(tmp_path.iterdir()) == []


def test_bones_are_listed_after_those_above_them(motion):
    bones = bones_of(motion)
    assert all(above < bone for bone, above in enumerate(bones.parents))
    assert bones.names[0] == "root"


def test_lengths_of_segments_lie_beside_a_trc(capsys, tmp_path):
    """A thigh of 0.43 m in the body file; the trunk's length changes as it bends."""
    body = shipped("human")
    pose = np.zeros((3, body.skeleton.num_dofs), np.float32)
    pose[1, body.skeleton.dof_names.index("spine_bend")] = 0.8
    pose[:, body.skeleton.dof_names.index("left_knee")] = [0.0, 0.5, 1.0]
    save_motion(tmp_path / "motion.npz", motion_from_poses(body, pose, 25.0))
    source = f"motion={tmp_path / 'motion.npz'}"
    out, _ = done(capsys, "export", source, f"to={tmp_path / 'walk.trc'}")
    assert out.splitlines() == [str(tmp_path / "walk.lengths.csv"), str(tmp_path / "walk.trc")]
    rows = list(csv.DictReader((tmp_path / "walk.lengths.csv").read_text().splitlines()[1:]))
    found = {(row["measurement"], row["from"]): (float(row["length"]), float(row["range"])) for row in rows}
    assert found["thigh", "LHip"] == (0.43, 0.0)
    assert found["shank", "RKnee"] == (0.41, 0.0)
    assert found["pelvis", "RHip"] == (0.176, 0.0)
    assert found["torso", "LShoulder"][1] > 0.01
    done(capsys, "export", source, f"to={tmp_path / 'walk.mot'}")  # whose lengths are the same
    (tmp_path / "walk.trc").unlink()
    (tmp_path / "walk.lengths.csv").write_text("another's\n")
    assert "walk.lengths.csv: already exists" in refused(capsys, "export", source, f"to={tmp_path / 'walk.trc'}")
    assert not (tmp_path / "walk.trc").exists()


def test_a_table_marks_what_is_hidden(motion, tmp_path):
    """Each limb's confidence is no more than the part of it that is seen; unknown is none."""
    count = motion.num_frames
    doubt, hidden = np.full((count, 2), 0.1), np.zeros((count, 2))
    hidden[2, 0], doubt[3, 1] = 1.0, np.nan
    judged = dataclasses.replace(
        motion, limb_names=np.array(["left arm", "head"]), limb_doubt=doubt, limb_hidden=hidden
    )
    export_motion(judged, tmp_path / "a.csv")
    rows = list(csv.DictReader((tmp_path / "a.csv").read_text().splitlines()[1:]))
    read = np.array([[float(row[f"{limb}.confidence"]) for limb in ("left arm", "head")] for row in rows])
    expected = np.full((count, 2), 0.9)
    expected[2, 0] = expected[3, 1] = 0.0
    np.testing.assert_allclose(read, expected, atol=1e-6)


@pytest.mark.parametrize("ending", sorted({*WRITERS} - {".npz"}))
def test_no_file_holds_what_is_not_a_number(tmp_path, ending):
    body = shipped("human")
    motion = motion_from_poses(body, np.zeros((3, body.skeleton.num_dofs), np.float32), 25.0)
    path = tmp_path / f"a{ending}"
    export_motion(motion, path)
    assert b"nan" not in path.read_bytes().lower() or ending in (".glb", ".c3d")
    path.unlink()
    motion.world_from_joint[1] = np.nan
    with pytest.raises(InputError, match="not finite in frame 1"):
        export_motion(motion, path)
    assert not path.exists()
