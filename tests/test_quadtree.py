"""The quad-tree of Section 4.1 against one that is written recursively in numpy."""

import cv2
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rig_cases import ring_rig

from sogjax.scene.cells import CellGrid
from sogjax.scene.quadtree import Candidates, keep_blobs, quadtree

STRAIGHT = (0.0,) * 5
SIZES = [(64, 48, 3), (100, 76, 4), (48, 64, 3), (101, 77, 4)]
"""Width, height, depth: whole cells, half cells at the edge, portrait, odd sizes."""

run = jax.jit(quadtree)


def camera(width, height, distortion=STRAIGHT):
    return ring_rig(1, (width, height), distortion).cameras


def first(tree):
    return jax.tree.map(lambda leaf: leaf[0], tree)


def nodes(width, height, depth):
    grid = CellGrid.from_depth(width, height, depth)
    return grid, first(Candidates.from_grids([grid], camera(width, height)))


def picture(grid, seed):
    """Cells with large plain parts and small details."""
    rng = np.random.default_rng(seed)
    coarse = rng.random((-(-grid.rows // 4), -(-grid.columns // 4), 3))
    cells = np.kron(coarse, np.ones((4, 4, 1)))[: grid.rows, : grid.columns]
    noisy = rng.random(cells.shape[:2]) < 0.15
    return np.where(noisy[..., None], rng.random(cells.shape), cells).astype(np.float32)


def leaves_of(candidates, cells, tolerance):
    """Rows of (x, y, sigma, red, green, blue) of the leaves, sorted."""
    colors, leaves = run(jnp.asarray(cells), candidates, jnp.asarray(tolerance, jnp.float32))
    table = np.column_stack([candidates.means, candidates.sigmas, colors])[np.asarray(leaves)]
    return table[np.lexsort(table[:, :2].T)]


def recursive_leaves(grid, cells, tolerance):
    """The same by recursion from the smallest power-of-two square that holds the image."""
    found = []

    def visit(x, y, side):
        """A node by its first cell and its side, in cells."""
        if x >= grid.columns or y >= grid.rows:
            return
        pixels = side * grid.cell_size
        left, top = x * grid.cell_size, y * grid.cell_size
        block = cells[y : y + side, x : x + side].reshape(-1, 3).astype(float)
        deviation = np.sqrt(np.sum(np.var(block, axis=0)))
        if side == 1:
            seen = min(pixels, grid.width - left) * min(pixels, grid.height - top)
            is_leaf = seen >= 0.5 * pixels**2
        else:
            fits = left + pixels <= grid.width and top + pixels <= grid.height
            is_leaf = fits and tolerance >= 0.0 and deviation <= tolerance
        if is_leaf:
            centre = np.array([left, top]) + 0.5 * pixels - 0.5
            found.append([*centre, pixels / 2.0, *block.mean(axis=0)])
        elif side > 1:
            for dy in (0, side // 2):
                for dx in (0, side // 2):
                    visit(x + dx, y + dy, side // 2)

    visit(0, 0, 1 << (max(grid.columns, grid.rows) - 1).bit_length())
    table = np.array(found)
    return table[np.lexsort(table[:, :2].T)]


@pytest.mark.parametrize(("width", "height", "depth"), SIZES)
@pytest.mark.parametrize("tolerance", [-1.0, 0.02, 0.1, 0.3, 5.0])
def test_leaves_are_those_of_a_recursive_quadtree(width, height, depth, tolerance):
    grid, candidates = nodes(width, height, depth)
    for seed in range(3):
        cells = picture(grid, seed)
        found, expected = leaves_of(candidates, cells, tolerance), recursive_leaves(grid, cells, tolerance)
        assert len(found) == len(expected)
        np.testing.assert_allclose(found[:, 3:], expected[:, 3:], atol=1e-5)
        np.testing.assert_allclose(found[:, :3], expected[:, :3], atol=1e-3)


@pytest.mark.parametrize(("width", "height", "depth"), SIZES)
def test_leaves_tile_the_image(width, height, depth):
    """No pixel of a whole cell is covered twice, or not at all."""
    grid, candidates = nodes(width, height, depth)
    covered = np.zeros((grid.rows * grid.cell_size, grid.columns * grid.cell_size), int)
    for x, y, sigma, *_ in leaves_of(candidates, picture(grid, 5), 0.2):
        left, top, side = round(x + 0.5 - sigma), round(y + 0.5 - sigma), round(2.0 * sigma)
        covered[top : top + side, left : left + side] += 1
    size = grid.cell_size
    assert (covered[: height // size * size, : width // size * size] == 1).all()
    assert covered.max() == 1
    assert abs(covered.sum() - width * height) <= 0.5 * size * (width + height + size)


def test_a_plain_image_has_few_leaves_and_a_negative_tolerance_gives_one_a_cell():
    """64 x 48 pixels hold two squares of 32 pixels and, below them, four of 16."""
    grid, candidates = nodes(64, 48, 3)
    plain = np.full((grid.rows, grid.columns, 3), 0.4, np.float32)
    assert sorted(leaves_of(candidates, plain, 0.1)[:, 2]) == [8.0] * 4 + [16.0] * 2
    single = leaves_of(candidates, plain, -1.0)
    assert len(single) == 48
    assert (single[:, 2] == 4.0).all()


def test_single_cells_of_a_full_size_picture():
    """1296 x 972 pixels at depth 7: 81 x 61 cells of 16 pixels; the last row is covered by three quarters."""
    _, candidates = nodes(1296, 972, 7)
    cells = np.random.default_rng(0).random((61, 81, 3)).astype(np.float32)
    table = leaves_of(candidates, cells, -1.0)
    assert len(table) == 81 * 61
    np.testing.assert_allclose(table[:, 3:].reshape(61, 81, 3), cells, atol=1e-6)
    np.testing.assert_allclose(table[:2, :2], [[7.5, 7.5], [23.5, 7.5]], atol=1e-3)


def test_cameras_of_different_sizes_have_the_leaves_they_have_alone():
    sizes = [(64, 48), (48, 64), (32, 24)]
    grids = [CellGrid.from_depth(*size, 3) for size in sizes]
    cameras = jax.tree.map(lambda *leaves: jnp.concatenate(leaves), *[camera(*size) for size in sizes])
    together = Candidates.from_grids(grids, cameras)
    for k, (size, grid) in enumerate(zip(sizes, grids, strict=True)):
        alone, cells = nodes(*size, 3)[1], picture(grid, k)
        padded = np.full((max(g.rows for g in grids), max(g.columns for g in grids), 3), 0.3, np.float32)
        padded[: grid.rows, : grid.columns] = cells
        one = jax.tree.map(lambda leaf, k=k: leaf[k], together)
        np.testing.assert_allclose(leaves_of(one, padded, 0.2), leaves_of(alone, cells, 0.2), atol=1e-4)


def test_blob_centres_are_undistorted_as_opencv_does():
    distortion = (-0.2, 0.05, 1e-3, -2e-3, 0.01)
    _, straight = nodes(320, 240, 4)
    curved = camera(320, 240, distortion)
    found = first(Candidates.from_grids([CellGrid.from_depth(320, 240, 4)], curved))
    matrix = np.asarray(curved.intrinsics[0], float)
    pixels = np.asarray(straight.means, float)[np.asarray(straight.inside)]
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
    expected = cv2.undistortPoints(
        pixels.reshape(-1, 1, 2), matrix, np.array(distortion), R=np.eye(3), P=matrix, criteria=criteria
    ).reshape(-1, 2)
    np.testing.assert_allclose(np.asarray(found.means)[np.asarray(straight.inside)], expected, atol=2e-2)
    assert np.abs(expected - pixels).max() > 5.0
    np.testing.assert_array_equal(found.sigmas, straight.sigmas)


@pytest.mark.parametrize(("capacity", "kept"), [(4, 4), (10, 10), (16, 10)])
def test_the_count_of_chosen_blobs_is_the_true_one_whatever_the_capacity(capacity, kept):
    rng = np.random.default_rng(0)
    means, sigmas, colors = (jnp.asarray(rng.random(shape), jnp.float32) for shape in ((30, 2), (30,), (30, 3)))
    keep = jnp.zeros(30, bool).at[rng.permutation(30)[:10]].set(True)
    sog, chosen, count = jax.jit(keep_blobs, static_argnums=4)(means, sigmas, colors, keep, capacity)
    assert count == 10
    assert sog.capacity == capacity
    assert sog.mask.sum() == kept
    np.testing.assert_array_equal(chosen[:kept], np.flatnonzero(keep)[:kept])
    np.testing.assert_array_equal(sog.means[:kept], means[chosen[:kept]])
    np.testing.assert_array_equal(sog.colors[:kept], colors[chosen[:kept]])
    np.testing.assert_array_equal(sog.sigmas[:kept], sigmas[chosen[:kept]])
    assert (sog.sigmas[kept:] > 0.0).all()
