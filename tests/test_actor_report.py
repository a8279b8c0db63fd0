"""The actor's report: silhouettes against masks, bone lengths, what was not determined, and the files."""

import json
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import reference_frames, shipped
from browser import faults_of
from drawn_scene import DISC, draw, in_colors, moved, standing
from rig_cases import opencv_pixels, ring_rig
from tiny_body import make_body

from sogjax.actor.coverage import body_silhouette, overlap_ratio, silhouette_iou
from sogjax.actor.doubts import doubt_of, unlike_sides, unseen_limbs
from sogjax.actor.limb_colors import limb_pairs_alike
from sogjax.actor.make import MadeActor
from sogjax.actor.report import actor_report
from sogjax.actor.silhouette_fit import Estimate
from sogjax.actor.silhouettes import PosedPictures
from sogjax.model.body import Attachments
from sogjax.model.bones import bone_lengths
from sogjax.model.limbs import limb_blobs, limb_names
from sogjax.model.shape import ShapeModel
from sogjax.run.actor_report import report_folder, report_page, write_actor_report
from sogjax.view.sheets import (
    BACKGROUND,
    BOTH,
    ONLY_BODY,
    ONLY_MASK,
    UNTOLD,
    SilhouetteView,
    body_picture,
    silhouette_sheet,
)

SIGMA = 0.2
HALF = np.sqrt(2.0 * np.log(2.0))
"""Where a Gaussian of sigma 1 has fallen to a half."""


def one_blob(place):
    body = make_body()
    blob = Attachments(("ball",), (5,), jnp.asarray([place], jnp.float32))
    parts = lambda b: (b.blobs, b.blob_sigmas, b.blob_colors)
    return eqx.tree_at(parts, body, (blob, jnp.array([SIGMA]), jnp.full((1, 3), 0.5)))


def disc(rig, name, place, radius_metres):
    camera, (width, height) = rig.camera(name), rig.image_size(name)
    pose = np.asarray(camera.camera_from_world, float)
    radius = radius_metres * float(camera.focal_length) / float((pose[:3, :3] @ place + pose[:3, 3])[2])
    x, y = opencv_pixels(rig, name, [place])[0]
    rows, columns = np.mgrid[:height, :width]
    return (columns - x) ** 2 + (rows - y) ** 2 < radius**2


def test_the_silhouette_of_one_blob_is_a_disc():
    """Through a distorting lens too, where the disc's centre is OpenCV's."""
    place = np.array([0.3, -0.2, 1.4])
    body = one_blob(place)
    for distortion in ((0.0,) * 5, (-0.2, 0.05, 1e-3, -2e-3, 0.01)):
        rig = ring_rig(2, distortion=distortion)
        for name in rig.names:
            seen = body_silhouette(body, body.poses["rest"], rig.camera(name), (240, 320))
            assert overlap_ratio(seen, disc(rig, name, place, HALF * SIGMA)) > 0.97


@pytest.mark.parametrize("ratio", [0.7, 1.0, 1.5])
def test_the_iou_of_two_discs_is_the_ratio_of_their_areas(ratio):
    place = np.array([0.0, 0.0, 1.2])
    rig = ring_rig(1, size=(1296, 972), distortion=(0.0,) * 5)  # larger than what is compared
    found = silhouette_iou(
        one_blob(place), make_body().poses["rest"], rig.camera("cam0"), disc(rig, "cam0", place, ratio * HALF * SIGMA)
    )
    assert abs(found - min(ratio, 1.0 / ratio) ** 2) < 0.02


def test_what_a_mask_does_not_tell_is_left_out_of_the_iou():
    place, rig = np.array([0.0, 0.0, 1.2]), ring_rig(1, distortion=(0.0,) * 5)
    body, mask = one_blob(place), disc(rig, "cam0", place, HALF * SIGMA)
    left = np.arange(mask.shape[1]) < np.nonzero(mask)[1].mean()
    seen = lambda untold: silhouette_iou(body, body.poses["rest"], rig.camera("cam0"), mask & ~left, untold)
    assert seen(None) < 0.55
    assert seen(np.broadcast_to(left, mask.shape)) > 0.95


def test_limbs_that_no_mask_shows_are_said():
    made = made_dog()
    members = limb_blobs(made.body)
    assert unseen_limbs(made.body, np.ones(made.body.num_blobs, bool), made.pictures) is None
    said = unseen_limbs(made.body, ~members[1], made.pictures)
    assert said is not None
    assert said.startswith(f"the {limb_names(made.body)[1]} of the actor may be anywhere")
    assert "background/CAMERA.jpg" in said
    assert actor_report(replace(made, doubt=said), RIG).warnings[0] == said


def test_limbs_whose_sides_have_other_colours_are_said():
    made = made_dog()
    pair, colors = limb_pairs_alike(made.body)[0], np.full((made.body.num_blobs, 3), 0.5)
    assert unlike_sides(made.body, colors, [], made.pictures) is None
    colors[pair.blobs[1]] = 0.3
    said = unlike_sides(made.body, colors, [pair], made.pictures)
    one, other = (limb_names(made.body)[k] for k in pair.limbs)
    assert said is not None
    assert said.startswith(f"the {one} or {other} (0.35 apart) of the actor was not found")
    assert "example_poses" in said


def test_a_body_behind_the_camera_has_no_silhouette():
    rig = ring_rig(1)
    body = one_blob(np.array([8.0, 3.0, 1.6]))
    assert not body_silhouette(body, body.poses["rest"], rig.camera("cam0"), (120, 160)).any()


def test_bones_of_a_body_made_by_hand():
    found = bone_lengths(make_body())
    expected = {
        "root - spine bend": 0.2,
        "spine bend - left shoulder": np.hypot(0.2, 0.3),
        "left upper arm": 0.3,
        "root - left hip": np.hypot(0.1, 0.05),
    }
    for bone, length in expected.items():
        assert found[bone] == pytest.approx(length)


def test_bones_of_the_human_body_keep_their_length_in_every_pose():
    """Distances of joints by forward kinematics written a second time; arms have roll joints halfway."""
    body = shipped("human")
    frames = reference_frames(body.skeleton, np.random.default_rng(0).uniform(-1.0, 1.0, body.skeleton.num_dofs))
    at = lambda name: frames[body.skeleton.names.index(name), :3, 3]
    found = bone_lengths(body)
    for side in ("left", "right"):
        for bone, top, end in (
            ("upper arm", "shoulder_roll", "elbow"),
            ("forearm", "elbow", "wrist_bend"),
            ("thigh", "hip_bend", "knee"),
            ("shank", "knee", "ankle_bend"),
        ):
            length = np.linalg.norm(at(f"{side}_{top}") - at(f"{side}_{end}"))
            assert found[f"{side} {bone}"] == pytest.approx(length, abs=1e-6)
    assert found["hip width"] == pytest.approx(np.linalg.norm(at("left_hip_bend") - at("right_hip_bend")), abs=1e-6)
    spine = [at(f"spine{k}_bend") for k in range(1, 6)]
    assert found["spine"] == pytest.approx(sum(np.linalg.norm(np.diff(spine, axis=0), axis=1)), abs=1e-6)
    assert min(found.values()) > 0.02


RIG = ring_rig(3, (160, 120), distance=1.6)


def made_dog():
    start = shipped("dog")
    model = ShapeModel.from_body(start)
    shape = jnp.zeros(model.num_shape_params).at[0].set(np.log(1.1))
    body = in_colors(model.shaped(shape))
    poses = {"stand": standing(body, 1.2)}
    poses["turned"] = moved(body, poses["stand"], {"root_yaw": 0.8})
    pictures = []
    for name, pose in poses.items():
        images, masks = draw(body, pose, RIG), draw(body, pose, RIG, masks=True)
        pictures.append(PosedPictures(name, dict(enumerate(images)), dict(enumerate(masks))))
    dofs = body.skeleton.num_dofs
    model = replace(model, spread=jnp.full(model.num_shape_params, 0.1))
    given = jnp.stack([jnp.asarray(pose) for pose in poses.values()])
    estimate = Estimate(given, shape, jnp.full((2, dofs), 0.02), jnp.full(model.num_shape_params, 0.02))
    return MadeActor(
        body, start, body, dict(zip(poses, given, strict=True)), {}, tuple(pictures), RIG.cameras, model, estimate
    )


@pytest.mark.slow
def test_a_good_actor_has_nothing_to_warn_of():
    made = made_dog()
    report = actor_report(made, RIG)
    assert {pose: list(cameras) for pose, cameras in report.ious.items()} == {
        pose: list(RIG.names) for pose in ("stand", "turned")
    }
    assert report.mean_iou > 0.85  # the masks were drawn as discs of 1.35 sigma, which nearly is the level of a half
    assert DISC == 1.35
    for bone in report.bones:
        assert bone.after == pytest.approx(1.1 * bone.before, rel=1e-4)
    assert report.warnings == report.notes == ()
    assert "Notes" not in report_page(report, made, RIG)


def test_a_size_that_no_body_has_is_said():
    made = made_dog()
    shape = made.estimate.shape_params.at[-1].set(0.2)
    estimate = eqx.tree_at(lambda e: e.shape_params, made.estimate, shape)
    (warning,) = actor_report(replace(made, estimate=estimate), RIG).warnings
    assert warning.startswith(f"{made.shape_names[-1]}: beyond what bodies differ by; masks may hold shadows")


def test_an_actor_of_another_size_than_its_masks_is_doubtful():
    made = made_dog()
    assert doubt_of(made.body, made.estimate.poses, made.pictures, made.rig) is None
    smaller = doubt_of(made.start, made.estimate.poses, made.pictures, made.rig)
    assert smaller is not None
    assert "(stand, turned)" in smaller


def test_what_the_pictures_did_not_tell_is_said():
    made = made_dog()
    elbow, place, once = (list(made.body.skeleton.dof_names).index(f"root_{part}") for part in ("yaw", "x", "roll"))
    of_poses = made.estimate.pose_deviations.at[:, elbow].set(jnp.array([0.5, 0.4])).at[0, once].set(3.0)
    estimate = replace(
        made.estimate,
        shape_deviations=made.estimate.shape_deviations.at[3].set(0.099).at[5].set(np.nan),
        pose_deviations=of_poses.at[:, place].set(jnp.array([np.nan, 0.2])),
    )
    masks = {k: np.roll(mask, 40, axis=1) for k, mask in made.pictures[1].masks.items()}
    pictures = (
        replace(made.pictures[0], warnings=("example pose 'stand': cam1 is left out",)),
        replace(made.pictures[1], masks=masks),
    )
    made = replace(made, estimate=estimate, pictures=pictures)
    report = actor_report(made, RIG)
    left_out, poor, first, second = sorted(report.warnings, key=_kind)
    assert left_out == "example pose 'stand': cam1 is left out"
    assert "'turned'" in poor
    assert "its picture in the report" in poor
    (sizes,) = report.notes
    assert all(f"{made.shape_names[k]} (by " in sizes for k in (3, 5))
    assert sizes.count("(by ") == 2
    assert "by 10%, without pictures 10%" in sizes
    assert f"<h3>Notes</h3><ul><li>{sizes}</li></ul>" in report_page(report, made, RIG)
    assert {first.split()[0], second.split()[0]} == {"root_x", "root_yaw"}
    assert "200 mm" in first + second
    assert "23 degrees" in first + second


def _kind(warning):
    kinds = ("left out", "silhouettes overlap", "never seen well")
    return next(k for k, words in enumerate(kinds) if words in warning)


def test_the_files_of_the_report(tmp_path):
    made = made_dog()
    folder = report_folder(tmp_path / "rex.yaml")
    assert folder == tmp_path / "rex_report"
    report = write_actor_report(folder, made, RIG)
    files = ["actor_report.json", "index.html"]
    assert sorted(path.name for path in folder.iterdir()) == files
    numbers = json.loads((folder / "actor_report.json").read_text())
    assert numbers == json.loads(json.dumps(report.as_dict()))
    assert numbers["mean_iou"] == pytest.approx(report.mean_iou)
    page = (folder / "index.html").read_text()
    for words in (
        "<h1>Actor dog</h1>",
        "pose stand",
        "pose turned",
        "cam2</th>",
        "left upper arm",
        "+10.0",
    ):
        assert words in page
    assert page.count("<img") == 3
    assert faults_of(folder / "index.html") == []


def test_colours_of_a_sheet_tell_mask_and_body_apart():
    rows, columns = np.mgrid[:60, :80]
    mask = (rows >= 20) & (rows < 40) & (columns >= 20) & (columns < 50)
    body = (rows >= 20) & (rows < 40) & (columns >= 30) & (columns < 60)
    image = np.full((120, 160, 3), 200, np.uint8)
    untold = columns >= 55
    sheet = silhouette_sheet([SilhouetteView("cam0", 0.5, image, mask, body, untold)], "dog").astype(float)
    painted = {
        color: int((np.abs(sheet - (0.55 * 100 + 0.45 * np.array(color))) < 0.51).all(axis=-1).sum())
        for color in (BOTH, ONLY_MASK, ONLY_BODY, UNTOLD)
    }
    for color, share in ((ONLY_MASK, 0.5), (ONLY_BODY, 0.25), (UNTOLD, 0.25)):
        assert painted[color] / painted[BOTH] == pytest.approx(share, abs=0.06)


def test_the_picture_of_a_body_shows_left_and_front_where_they_belong():
    """Three blobs above each other: left, right and in front of the middle."""
    means = np.array([[0.0, 0.3, 1.0], [0.0, -0.3, 0.5], [0.4, 0.0, 0.0]])
    colors = np.eye(3)
    picture = body_picture(means, np.full(3, 0.05), colors).astype(int)
    middle = lambda k: np.argwhere((np.abs(picture - 255 * np.eye(3, dtype=int)[2 - k]) < 3).all(-1))
    red, green, blue = (middle(k) for k in range(3))
    front = picture.shape[1] * 0.55
    of_front = lambda points: points[points[:, 1] < front].mean(axis=0)
    assert of_front(red)[1] > of_front(green)[1]  # the body's left is on the viewer's right
    assert of_front(red)[0] < of_front(green)[0] < blue[:, 0].mean()
    side = blue[blue[:, 1] > front]
    others = red[red[:, 1] > front]
    assert side[:, 1].mean() < others[:, 1].mean()  # seen from its left, it looks to the viewer's left
    assert (picture[0, 0] == BACKGROUND).all()
