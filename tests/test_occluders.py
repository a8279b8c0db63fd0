"""What stands in front of a body says nothing of it: neither for nor against, in every place where cells count."""

from dataclasses import replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import cells_of, draw, grids_of, in_colors, standing
from rig_cases import ring_rig
from small_recording import make_recording, write_image
from test_limb_doubt import judging

from sogjax.energy.frame_energy import FrameEnergy
from sogjax.energy.posed import History
from sogjax.errors import InputError
from sogjax.io.painted import painted_masks
from sogjax.io.recording import open_recording
from sogjax.model.limbs import limb_names
from sogjax.scene.occluders import Occluders, nothing_hidden, painted
from sogjax.scene.visual_hull import hull_coverage
from sogjax.search.cell_evidence import cell_evidence
from sogjax.search.pose_search import PoseSearch
from sogjax.search.seen_frame import SeenFrame
from sogjax.tracking.capacity import views_near
from sogjax.tracking.culling import Capacities
from sogjax.tracking.frame import FrameInput

DEPTH = 6
ROOM = Capacities(1024, 1024)


@pytest.fixture(scope="module")
def dog():
    """A dog, and a board in two cameras that hides its lower half."""
    body, rig = in_colors(shipped("dog")), ring_rig(5, (160, 120), distance=1.6)
    pose = standing(body, 1.1)
    masks = [None] * 5
    for camera in (0, 1):
        masks[camera] = np.zeros((120, 160), bool)
        masks[camera][56:104, 24:136] = True
    return judging(body, rig, with_background=True), rig, pose, masks


def with_board(rig, images, masks, colors):
    """Pictures with a board in some cameras: stripes of two colours (BGR)."""
    stripes = np.where((np.arange(160) // 8 % 2)[None, :, None] == 0, *np.array(colors, np.uint8))
    stripes = np.broadcast_to(stripes, (120, 160, 3))
    shown = [image if mask is None else np.where(mask[..., None], stripes, image)
             for image, mask in zip(images, masks, strict=True)]  # fmt: skip
    return cells_of(rig, shown, DEPTH)


BOARDS = ((30, 200, 30), (200, 30, 30)), ((90, 90, 90), (40, 60, 200))
"""Two boards; the first is coloured as the dog is."""


def energies(tracker, cells, poses):
    """The energies of poses in one frame, as it is seen around the first of them."""
    views = views_near(tracker, FrameInput(jnp.asarray(cells)), jnp.asarray(poses[0]), ROOM)
    energy = FrameEnergy(tracker.body, views, History.unknown(jnp.asarray(poses[0])), tracker.terms)
    return np.asarray(jax.vmap(energy)(jnp.asarray(np.stack(poses))))


def near(pose, count=4):
    """The pose, and others around it."""
    return [pose, *(pose + np.random.default_rng(3).normal(0.0, 0.15, (count, len(pose)))).astype(np.float32)]


def hidden_at(tracker, rig, masks, depth=0.0):
    cells = painted(masks, grids_of(rig, DEPTH))
    return replace(tracker, reader=tracker.reader.behind(np.where(cells == 0.0, depth, np.inf).astype(np.float32)))


@pytest.mark.slow
def test_colors_of_what_is_in_front_do_not_count_in_the_energy(dog):
    tracker, rig, pose, masks = dog
    one, other = (with_board(rig, draw(tracker.body, pose, rig), masks, colors) for colors in BOARDS)
    poses = near(pose)
    seen = np.abs(energies(tracker, one, poses) - energies(tracker, other, poses)).max()
    behind = hidden_at(tracker, rig, masks)
    unseen = np.abs(energies(behind, one, poses) - energies(behind, other, poses)).max()
    assert seen > 5e-4
    assert unseen < 0.01 * seen  # the boards change the light that is estimated, a little


@pytest.mark.slow
@pytest.mark.parametrize("pairs", ["sparse", "dense"])
def test_only_what_is_farther_than_the_thing_in_front_is_hidden(dog, pairs):
    tracker, rig, pose, masks = dog
    tracker = replace(tracker, pairs=pairs)
    cells = cells_of(rig, draw(tracker.body, pose, rig), DEPTH)
    plain, in_front, behind = (
        energies(each, cells, [pose])[0]
        for each in (tracker, hidden_at(tracker, rig, masks, 9.0), hidden_at(tracker, rig, masks, 0.5))
    )
    assert in_front == pytest.approx(plain, rel=1e-3)
    assert behind < 0.9 * plain


@pytest.mark.slow
def test_image_blobs_end_where_the_thing_in_front_does(dog):
    tracker, rig, _, masks = dog
    hidden = painted(masks, grids_of(rig, DEPTH))
    occluders, candidates = Occluders.of_cells(hidden, tracker.reader.candidates)
    cells = np.full((*hidden.shape, 3), 0.5, np.float32)
    before, after = (
        np.asarray(replace(tracker.reader, candidates=each, background=None).leaves(jnp.asarray(cells))[1])
        for each in (tracker.reader.candidates, candidates)
    )
    areas = np.asarray(candidates.sigmas) ** 2 * 4.0
    whole = (areas * after).sum(axis=1)
    assert whole == pytest.approx((areas * before).sum(axis=1), rel=1e-3)
    behind = (areas * after * (np.asarray(occluders.nodes) == 0.0)).sum(axis=1)
    painted_area = [0.0 if mask is None else mask.sum() for mask in masks]
    assert behind == pytest.approx(painted_area, rel=0.1)
    assert tracker.reader.behind(nothing_hidden(grids_of(rig, DEPTH))) is tracker.reader


@pytest.mark.slow
def test_a_hidden_limb_is_said_to_be_hidden_and_not_contradicted(dog):
    tracker, rig, pose, _ = dog
    names = limb_names(tracker.body)
    everywhere = [np.arange(120)[:, None] * np.ones((1, 160)) > 70 for _ in range(5)]
    cells = with_board(rig, draw(tracker.body, pose, rig), everywhere, BOARDS[1])
    unknown = jnp.full((2, tracker.body.num_blobs), jnp.nan)

    @eqx.filter_jit
    def judged(tracker):
        frame = FrameInput(jnp.asarray(cells))
        return tracker.judged(jnp.asarray(pose), unknown, tracker.windows(frame, tracker.start(pose)), frame)

    known, blind = judged(hidden_at(tracker, rig, everywhere)), judged(tracker)
    leg, head = (next(k for k, name in enumerate(names) if part in name) for part in ("leg", "head"))
    assert blind.hidden is None
    assert float(known.hidden[leg]) > 0.9
    assert float(known.hidden[head]) < 0.5
    assert float(known.explained[0]) > float(blind.explained[0]) + 0.1
    assert np.nanmin(known.overlap) > np.nanmin(blind.overlap) + 0.1


@pytest.mark.slow
def test_a_search_hears_nothing_from_hidden_cells(dog):
    tracker, rig, pose, masks = dog
    searcher = PoseSearch.of_body(tracker.body, tracker.terms, "z")
    cameras = jax.tree.map(jnp.asarray, rig.cameras)
    of = lambda tracker, colors: cell_evidence(
        searcher,
        SeenFrame.from_cells(
            cameras, tracker.reader, with_board(rig, draw(tracker.body, pose, rig), masks, colors), searcher.clusters
        ),
        pose,
    )
    behind = hidden_at(tracker, rig, masks)
    for name in ("foreground", "background", "gain"):
        one, other = (np.asarray(getattr(of(behind, colors), name)) for colors in BOARDS)
        np.testing.assert_allclose(one, other, atol=0.02)
    known = of(behind, BOARDS[0])
    assert np.all(np.asarray(known.visible)[:2] < 0.9)
    assert np.all(np.asarray(known.visible)[2:] > 0.99)
    heard = [np.asarray(of(tracker, colors).gain) for colors in BOARDS]
    assert np.all(np.abs(heard[0] - heard[1])[:2] > 0.3)  # a search that does not know of the boards hears them


def test_a_hull_reaches_behind_what_stands_in_front():
    rig = ring_rig(4, (160, 120), distance=1.6)
    body = in_colors(shipped("dog"))
    masks = dict(enumerate(draw(body, standing(body, 1.1), rig, masks=True)))
    cameras = {k: rig.camera(name) for k, name in enumerate(rig.names)}
    board = np.zeros((120, 160), bool)
    board[60:] = True
    cut = masks | {0: masks[0] & ~board}
    without, known = hull_coverage(cut, cameras), hull_coverage(cut, cameras, {0: board})
    assert min(without.values()) < 0.8
    assert min(known.values()) > 0.9


def painted_recording(folder, name="left.png", size=(64, 48), channels=1):
    recording = make_recording(folder / "recording")
    image = np.zeros((size[1], size[0], channels), np.uint8)
    image[: size[1] // 2] = 255
    write_image(recording / "occluders" / name, image)
    return recording


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_painted_pictures_may_be_grey_or_in_colors(tmp_path, channels):
    left, right = painted_masks(open_recording(painted_recording(tmp_path, channels=channels)))
    assert left is not None
    assert left[:24].all()
    assert not left[24:].any()
    assert right is None


def test_what_is_transparent_was_not_painted(tmp_path):
    recording = make_recording(tmp_path / "recording")
    image = np.full((48, 64, 4), 255, np.uint8)
    image[:, 32:, 3] = 0
    write_image(recording / "occluders" / "left.png", image)
    mask = painted_masks(open_recording(recording))[0]
    assert mask[:, :32].all()
    assert not mask[:, 32:].any()


def test_a_painted_picture_must_be_one_of_a_camera_and_of_its_size(tmp_path):
    with pytest.raises(InputError, match=r"occluders/middle\.png: there is no camera 'middle'.*left, right.*rename"):
        open_recording(painted_recording(tmp_path / "a", "middle.png"))
    with pytest.raises(InputError, match=r"occluders/left\.png: is 32x24, but the pictures of 'left' are 64x48; paint"):
        open_recording(painted_recording(tmp_path / "b", size=(32, 24)))
    broken = painted_recording(tmp_path / "c")
    (broken / "occluders" / "left.png").write_bytes(b"no image")
    with pytest.raises(InputError, match=r"left\.png: cannot be read as an image"):
        open_recording(broken)


def test_a_painted_picture_that_hides_all_is_said_to_do_so(tmp_path):
    recording = make_recording(tmp_path / "recording")
    image = np.full((48, 64), 255, np.uint8)
    write_image(recording / "occluders" / "left.png", image)
    with pytest.raises(InputError, match=r"occluders/left\.png: 100% of it is white, so its camera sees nobody; paint"):
        painted_masks(open_recording(recording))
    image[20:] = 0
    write_image(recording / "occluders" / "left.png", image)
    assert painted_masks(open_recording(recording))[0].any()
