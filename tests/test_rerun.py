"""The Rerun file, read back with Rerun's own reader."""

from collections import defaultdict
from dataclasses import replace

import cv2
import numpy as np
import pytest
from full_disk import files_of_at_most
from motion_cases import points_on, walking_motion
from rerun.chunk import RrdReader
from rig_cases import black, opencv_pixels, recording_of, ring_rig

from sogjax.errors import InputError
from sogjax.io.ground_truth import GroundTruth
from sogjax.quality.limb_warnings import in_doubt
from sogjax.view.bones import bones_from_motion
from sogjax.view.rerun.comparison import write_comparison, write_iterations
from sogjax.view.rerun.curves import plots_with
from sogjax.view.rerun.file import ImageBlobs, RerunFile, write_rerun
from sogjax.view.rerun.viewer import view_command


def read_back(path):
    """Every column of the file: {entity: {column: rows}}, rows in the order of the frames."""
    columns = defaultdict(dict)
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            columns[str(chunk.entity_path)].setdefault(name, []).extend(batch.column(name).to_pylist())
    return columns


@pytest.fixture
def motion():
    return walking_motion(6, first_frame=2)


def test_bodies_and_curves_are_in_the_file_frame_by_frame(tmp_path, motion):
    penalty = np.arange(6.0)
    path = tmp_path / "motion.rrd"
    with RerunFile(path, recording_of(ring_rig(), 10), ["ann"]) as file:
        file.write([motion], {"limit_penalty": penalty})
    found = read_back(path)
    blobs = found["/world/actors/ann/blobs"]
    np.testing.assert_allclose(blobs["Ellipsoids3D:centers"][-6:], motion.blob_means, atol=1e-6)
    strips = np.array(found["/world/actors/ann/skeleton"]["LineStrips3D:strips"])
    assert strips.shape == (6, 6, 2, 3)
    np.testing.assert_allclose(strips[:, 0, 0], motion.world_from_joint[:, 3, :3, 3], atol=1e-6)
    similarity = found["/curves/energy/similarity"]
    np.testing.assert_allclose(np.ravel(similarity["Scalars:scalars"]), motion.similarity)
    assert similarity["frame"] == list(range(2, 8))
    np.testing.assert_allclose(np.ravel(found["/curves/penalties/limit_penalty"]["Scalars:scalars"]), penalty)
    assert len(RrdReader(path).blueprints()) == 1


def test_pictures_are_freed_of_distortion_so_that_the_pinhole_holds(tmp_path):
    rig = ring_rig(2, size=(1280, 960), distortion=(-0.25, 0.06, 2e-3, -2e-3, 0.0))
    motion = walking_motion(1, still=True)
    point = np.array([0.35, 0.3, 1.6])
    images = black(rig)
    for image, name in zip(images, rig.names, strict=True):
        x, y = opencv_pixels(rig, name, point)
        cv2.circle(image, (round(x * 16), round(y * 16)), 6 * 16, (255, 255, 255), -1, cv2.LINE_AA, 4)
    path = tmp_path / "motion.rrd"
    write_rerun(path, recording_of(rig, 1), [motion], frames=[images])
    found = read_back(path)
    for name in rig.names:
        stored = found[f"/world/cameras/{name}"]
        matrix = np.array(stored["Pinhole:image_from_camera"][0]).reshape(3, 3).T  # column-major
        np.testing.assert_array_equal(np.ravel(stored["Pinhole:resolution"]), [640, 480])
        rotation = np.array(stored["Transform3D:mat3x3"][0]).reshape(3, 3).T
        center = np.ravel(stored["Transform3D:translation"][0])
        ray = matrix @ rotation.T @ (point - center)
        blob = found[f"/world/cameras/{name}/picture"]["EncodedImage:blob"][0][0]
        picture = cv2.imdecode(np.frombuffer(bytes(blob), np.uint8), cv2.IMREAD_GRAYSCALE).astype(float)
        picture[picture < 40] = 0.0
        ys, xs = np.mgrid[:480, :640]
        seen = np.array([(xs * picture).sum(), (ys * picture).sum()]) / picture.sum() + 0.5
        # half a pixel is added: Rerun's pixel (0, 0) is the corner of the picture
        np.testing.assert_allclose(seen, ray[:2] / ray[2], atol=0.5)


def test_image_blobs_and_markers_lie_in_the_small_picture_and_the_world(tmp_path, motion):
    rig = ring_rig(1)
    markers = np.concatenate([np.full((2, 2, 3), 9.0), points_on(motion, (3, 6), np.zeros((2, 3)))])
    markers[3, 0] = np.nan
    sog = ImageBlobs(np.array([[-0.5, -0.5], [319.5, 239.5]]), np.array([4.0, 8.0]), np.array([[1, 0, 0], [0, 0.5, 1]]))
    path = tmp_path / "motion.rrd"
    truth = GroundTruth(50.0, markers, ("a", "b"))
    recording = recording_of(rig, 8)
    with RerunFile(path, recording, ["ann"], picture_width=160) as file:
        file.write([motion], {})
        for frame in motion.frame:
            file.write_pictures(int(frame), [], [sog])
        file.write_markers(truth)
    found = read_back(path)
    blobs = found["/world/cameras/cam0/blobs"]
    np.testing.assert_allclose(blobs["Points2D:positions"][0], [[0, 0], [160, 120]])
    np.testing.assert_allclose(blobs["Points2D:radii"][0], [2.0, 4.0])
    assert blobs["frame"] == list(range(2, 8))
    shown = found["/world/truth/markers"]["Points3D:positions"]
    shown = [row for row in shown if row]
    assert [len(row) for row in shown] == [2, 1, 2, 2, 2, 2]
    np.testing.assert_allclose(shown[1][0], markers[3, 1], atol=1e-6)


def test_several_actors_have_their_own_entities(tmp_path, motion):
    path = tmp_path / "motion.rrd"
    write_rerun(path, recording_of(ring_rig(1), 8, up="-y"), [motion, motion])
    found = read_back(path)
    for name in ("actor", "actor_2"):
        assert f"/world/actors/{name}/blobs" in found
        assert f"/curves/energy/energy/{name}" in found
    assert np.ravel(found["/world"]["ViewCoordinates:xyz"])[1] == 2  # ViewDir.Down: y points down


def test_a_motion_of_another_recording_is_refused_and_leaves_no_file(tmp_path, motion):
    with pytest.raises(InputError, match="give the recording that was tracked"):
        write_rerun(tmp_path / "a.rrd", recording_of(ring_rig(1), 5), [motion], frames=[black(ring_rig(1))] * 6)
    assert list(tmp_path.iterdir()) == []


def test_the_viewer_listens_to_this_machine_only(tmp_path):
    command = view_command(tmp_path / "a.rrd", web=True)
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    assert view_command(tmp_path / "a.rrd")[-2:] == ["--bind", "127.0.0.1"]


def test_runs_lie_side_by_side_in_trees_of_their_own(tmp_path, motion):
    other = walking_motion(6, first_frame=2, still=True)
    errors = {"a=1": np.linspace(0.0, 0.1, 6), "a=2 m/s": np.linspace(0.1, 0.2, 6)}
    path = tmp_path / "runs.rrd"
    write_comparison(path, recording_of(ring_rig(), 10), {"a=1": [motion], "a=2 m/s": [other]}, errors=errors)
    found = {entity.replace("\\", ""): columns for entity, columns in read_back(path).items()}
    seen = []
    for name, shown in (("a=1", motion), ("a=2 m/s", other)):
        blobs = found[f"/world/runs/{name}/actor_1/blobs"]["Ellipsoids3D:centers"]
        np.testing.assert_allclose(blobs[-6:], shown.blob_means, atol=1e-6)
        np.testing.assert_allclose(
            np.ravel(found[f"/curves/errors/error_mm/{name}"]["Scalars:scalars"]), 1e3 * errors[name]
        )
        bones = set(np.ravel(found[f"/world/runs/{name}/actor_1/skeleton"]["LineStrips3D:colors"][0]).tolist())
        curves = ("errors/error_mm", "energy/similarity", "energy/energy", "iterations/iterations")
        colors = [np.ravel(found[f"/curves/{curve}/{name}"]["SeriesLines:colors"][0]).item() for curve in curves]
        assert set(colors) <= bones
        assert colors[1] != colors[2]  # which share a plot
        seen.append(bones)
    assert seen[0].isdisjoint(seen[1])
    assert len(RrdReader(path).blueprints()) == 1


def test_iterations_have_a_timeline_of_their_own(tmp_path, motion):
    path = tmp_path / "iterations.rrd"
    write_iterations(path, recording_of(ring_rig(), 10), motion, np.arange(6.0))
    found = read_back(path)
    blobs = found["/world/iterations/blobs"]
    assert [n for n in blobs["iteration"] if n is not None] == list(range(6))
    np.testing.assert_allclose([row for row in blobs["Ellipsoids3D:centers"] if row][-6:], motion.blob_means, atol=1e-6)
    assert np.ravel(found["/curves/energy/energy"]["Scalars:scalars"]).tolist() == list(range(6))


def test_limbs_in_doubt_have_balls_around_their_joints(tmp_path, motion):
    left = np.array([0 if "left" in name else -1 for name in motion.joint_names])
    doubt = np.linspace(0.0, 1.0, motion.num_frames)[:, None]
    judged = replace(motion, limb_names=np.array(["left arm"]), joint_limb=left, limb_doubt=doubt)
    judged = replace(judged, limb_rival=0.01 * doubt)
    write_rerun(tmp_path / "judged.rrd", recording_of(ring_rig(), 10), [judged], names=["ann"])
    found = read_back(tmp_path / "judged.rrd")
    radii = [row for row in found["/world/actors/ann/doubtful"]["Points3D:radii"] if row]
    drawn = bones_from_motion(motion).joints
    assert len(radii) == int(in_doubt(judged).sum())
    assert {len(row) for row in radii} == {int((left[drawn] == 0).sum())}
    assert radii[-1] == pytest.approx([0.06] * len(radii[-1]))
    assert np.allclose(np.ravel(found["/curves/doubts/doubt_left_arm"]["Scalars:scalars"]), doubt.ravel())
    assert np.allclose(np.ravel(found["/curves/rivals/rival_left_arm"]["Scalars:scalars"]), doubt.ravel())


@pytest.mark.parametrize("size", [20, 3000, 20_000, 40_000])
def test_a_file_for_which_there_is_no_room_is_refused(tmp_path, motion, size):
    """Rerun itself waits forever for some of these sizes."""
    recording = recording_of(ring_rig(), 10)
    write_rerun(tmp_path / "whole.rrd", recording, [motion])
    assert size < (tmp_path / "whole.rrd").stat().st_size
    with files_of_at_most(size), pytest.raises(InputError, match=r"a\.rrd: could not be written") as error:
        write_rerun(tmp_path / "a.rrd", recording, [motion])
    assert "\n" not in str(error.value)
    assert [path.name for path in tmp_path.iterdir()] == ["whole.rrd"]


def test_a_term_that_a_user_added_has_a_plot_beside_the_penalties():
    assert plots_with(["similarity", "energy", "limit_penalty", "floor"]).keys() == {"energy", "penalties", "terms"}
