"""Learning from which depth on cells are hidden: where a body is missed although others see it."""

from dataclasses import replace

import cv2
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from drawn_scene import BACKGROUND, draw, grids_of, in_colors, moved, standing
from rig_cases import recording_of, ring_rig
from test_limb_doubt import judging

from sogjax.run.clip import Clip
from sogjax.run.learn_occluders import LearntOccluders, Look
from sogjax.run.setup import Setup
from sogjax.scene.cells import stack_cells
from sogjax.scene.occluders import DepthCounts, cells_covered
from sogjax.tracking.frame import FrameInput

DEPTH, LOOKS = 6, 14
SIZE = (160, 120)
BOARD = (200, 120, 40)
"""The board's colour (BGR), which the empty scene has, too."""


def counts_of(looks):
    """Of one cell in the middle of others that are alike; each look is a depth and a probability of foreground."""
    counts = DepthCounts.empty((1, 5, 5), 1.0, 4.0)
    rows, columns = np.mgrid[:5, :5].reshape(2, -1)
    for depth, foreground in looks:
        cells = (np.zeros(25, int), rows, columns)
        counts.add(cells, np.full(25, depth, np.float32), np.full(25, foreground, np.float32))
    return counts.hidden_from()[0, 2, 2]


def test_a_cell_is_hidden_from_where_the_body_was_missed_and_not_before():
    assert counts_of([(3.0, 0.02)] * 3) == pytest.approx(2.85, abs=0.1)
    assert counts_of([(2.9, 0.95)] * 3 + [(3.4, 0.02)] * 4) == pytest.approx(3.2, abs=0.25)
    assert counts_of([(3.0, 0.02)]) == np.inf  # too few misses
    assert counts_of([(3.0, 0.95)] * 5) == np.inf  # seen
    assert counts_of([(3.0, 0.02)] * 3 + [(3.5, 0.95)] * 6) == np.inf  # seen behind: a thing cannot hide only there
    assert counts_of([(3.0, 0.5)] * 3) == np.inf  # nothing is told


def test_the_nearest_blob_covers_a_cell():
    places, radii = np.array([[10.0, 8.0], [13.0, 8.0], [np.nan, 8.0]]), np.array([4.0, 4.0, 4.0])
    blob = cells_covered(places, radii, np.array([2.0, 1.0, 0.5]), (20, 30))
    assert blob[8, 7] == 0
    assert blob[8, 11] == 1
    assert blob[8, 20] == -1


@pytest.fixture(scope="module")
def scene():
    """A dog that walks across and back, a board before its legs in three of eight cameras, and the empty scene."""
    body, rig = in_colors(shipped("dog")), ring_rig(8, SIZE, distance=1.9)
    poses = [moved(body, standing(body, 1.1), {"root_x": 0.3 * np.sin(0.8 * k), "root_yaw": 0.1 * k})
             for k in range(LOOKS)]  # fmt: skip
    boards = [None] * 8
    for camera in (0, 1, 2):
        boards[camera] = np.zeros((120, 160), bool)
        boards[camera][68:, 10:150] = True
    return judging(body, rig, with_background=True), rig, poses, boards


def cells_with(rig, images, boards):
    shown = [image if mask is None else np.where(mask[..., None], np.uint8(BOARD), image)
             for image, mask in zip(images, boards, strict=True)]  # fmt: skip
    return stack_cells(shown, grids_of(rig, DEPTH))


def looked(scene, boards, poses, believed):
    """What is learnt of a dog in poses that is believed to be in others."""
    tracker, rig, _, _ = scene
    empty = [np.full((120, 160, 3), BACKGROUND, np.uint8)] * 8
    background = tracker.reader.background
    plate = cells_with(rig, empty, boards).astype(np.float32) / 255.0
    planes = tuple(jnp.asarray(plate[..., k]) for k in range(3))
    reader = replace(tracker.reader, background=replace(background, planes=planes))
    clip = Clip(recording_of(rig, LOOKS), range(LOOKS), DEPTH)
    setup = Setup(clip, (tracker.body,), replace(tracker, reader=reader))
    frames = [FrameInput(cells_with(rig, draw(tracker.body, pose, rig), boards)) for pose in poses]
    look = Look(setup, np.stack(believed), 0.4)
    for at, frame in enumerate(frames):
        look.add(at, frame)
    hidden = look.counts.hidden_from()
    return hidden, [look.hidden_share(at, hidden) for at in range(len(poses))], look.counts


def covered_by(scene, camera, poses):
    """Cells of a camera that the dog covers."""
    tracker, rig, _, _ = scene
    masks = [draw(tracker.body, pose, rig, masks=True)[camera] for pose in poses]
    shape = grids_of(rig, DEPTH)[camera]
    return np.array([cv2.resize(m.astype(np.float32), (shape.columns, shape.rows), interpolation=cv2.INTER_AREA) > 0.9
                     for m in masks])  # fmt: skip


@pytest.mark.slow
def test_a_board_before_the_legs_is_learnt_where_there_is_evidence(scene):
    _, _, poses, boards = scene
    hidden, shares, counts = looked(scene, boards, poses, poses)
    grid = grids_of(scene[1], DEPTH)[0]
    for camera in (0, 1, 2):
        small = boards[camera].astype(np.float32)
        board = cv2.resize(small, (grid.columns, grid.rows), interpolation=cv2.INTER_AREA) > 0.5
        evidence = (counts.seen + counts.missed)[camera, : grid.rows, : grid.columns].sum(axis=-1) >= 3.0
        found = np.isfinite(hidden[camera, : grid.rows, : grid.columns])
        both, either = (found & board & evidence).sum(), ((found | board) & evidence).sum()
        assert either > 10
        assert both / either >= 0.7
    assert not np.isfinite(hidden[3:]).any()
    assert max(shares) > 0.05


@pytest.mark.slow
def test_nothing_is_learnt_where_nothing_stands_in_front(scene):
    _, _, poses, _ = scene
    hidden, shares, _ = looked(scene, [None] * 8, poses, poses)
    assert not np.isfinite(hidden).any()
    assert max(shares) == 0.0


@pytest.mark.slow
def test_a_limb_that_is_held_wrong_is_not_taken_for_hidden(scene):
    """No camera sees it there, so that none can miss it."""
    tracker, _, poses, _ = scene
    wrong = [moved(tracker.body, pose, {"left_front_swing": 0.9, "left_elbow": -0.4}) for pose in poses]
    hidden, _, _ = looked(scene, [None] * 8, poses, wrong)
    assert np.isfinite(hidden).mean() < 0.001
    beside = [covered_by(scene, camera, wrong).any(axis=0) for camera in range(8)]
    learnt = np.isfinite(hidden[:, : beside[0].shape[0], : beside[0].shape[1]])
    assert (learnt & beside).sum() < 0.01 * np.sum(beside)


def test_what_was_learnt_is_kept(tmp_path):
    assert LearntOccluders.load(tmp_path) is None
    LearntOccluders(None).save(tmp_path)
    assert LearntOccluders.load(tmp_path) == LearntOccluders(None)
    hidden = np.where(np.arange(12).reshape(1, 3, 4) > 8, 2.5, np.inf).astype(np.float32)
    LearntOccluders(hidden, (3, 9)).save(tmp_path)
    found = LearntOccluders.load(tmp_path)
    np.testing.assert_array_equal(found.hidden, hidden)
    assert found.rows == (3, 9)


def test_what_hides_goes_on_a_little_where_nobody_was_seen_and_not_at_the_border():
    counts = DepthCounts.empty((1, 20, 30), 1.0, 4.0)
    rows, columns = (part.ravel() for part in np.mgrid[8:11, 10:16])
    once = (np.zeros(2, int), np.array([12, 18]), np.full(2, 12))
    counts.add(once, np.full(2, 3.0, np.float32), np.full(2, 0.02, np.float32))
    cells, depths = (np.zeros(len(rows), int), rows, columns), np.full(len(rows), 3.0, np.float32)
    for _ in range(6):
        counts.add(cells, depths, np.full(len(rows), 0.02, np.float32))
    beside = (np.zeros(3, int), np.arange(8, 11), np.full(3, 16))
    for _ in range(6):
        counts.add(beside, depths[:3], np.full(3, 0.98, np.float32))
    hidden = np.isfinite(counts.hidden_from()[0])
    assert hidden[8:11, 10:15].all()
    assert hidden[9, 9]
    assert hidden[12, 12]  # missed once only, but near what hides
    assert not hidden[18, 12]
    assert not hidden[9, 16]  # seen
    assert not hidden[:4].any()
    assert not hidden[:, 20:].any()
