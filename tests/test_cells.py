"""Frames cut into cells, against plain means of pixel blocks."""

import numpy as np
import pytest

from sogjax.scene.cells import CellGrid, stack_cells

GREY_LEVEL = 1.0
"""What rounding at every halving may amount to."""
FINE = 0.51
"""One rounding to a byte, in whichever direction."""


def random_image(width, height, seed=0):
    return np.random.default_rng(seed).integers(0, 256, (height, width, 3), np.uint8)


@pytest.mark.parametrize(
    ("size", "depth", "cell", "cells"),
    [
        ((1296, 972), 8, 8, (162, 122)),
        ((1296, 972), 7, 16, (81, 61)),
        ((972, 1296), 7, 16, (61, 81)),
        ((64, 48), 3, 8, (8, 6)),
        ((65, 48), 3, 16, (5, 3)),
        ((101, 77), 4, 8, (13, 10)),
        ((40, 30), 9, 1, (40, 30)),
        ((2048, 2048), 8, 8, (256, 256)),
    ],
)
def test_the_root_is_the_smallest_power_of_two_that_holds_the_image(size, depth, cell, cells):
    grid = CellGrid.from_depth(*size, depth)
    assert grid.cell_size == cell
    assert (grid.columns, grid.rows) == cells


@pytest.mark.parametrize(("width", "height"), [(64, 48), (101, 77), (48, 65), (70, 9)])
@pytest.mark.parametrize("depth", [2, 4, 9])
def test_a_cell_is_the_mean_of_its_pixels(width, height, depth):
    """The last row and column hold only the pixels there are."""
    image = random_image(width, height)
    grid = CellGrid.from_depth(width, height, depth)
    averages, side = grid.averages(image), grid.cell_size
    assert averages.shape == (grid.rows, grid.columns, 3)
    expected = [
        [
            image[r * side : (r + 1) * side, c * side : (c + 1) * side].reshape(-1, 3).mean(axis=0)
            for c in range(grid.columns)
        ]
        for r in range(grid.rows)
    ]
    np.testing.assert_allclose(averages, expected, atol=GREY_LEVEL)


@pytest.mark.parametrize(("size", "cell"), [((64, 48), 4), ((1296, 972), 8), ((101, 77), 2)])
def test_means_of_one_channel_are_exact_but_for_the_first_halving(size, cell):
    width, height = size
    plane = random_image(width, height)[..., 0]
    grid = CellGrid(width, height, cell)
    rows, columns = height // cell, width // cell
    whole = plane[: rows * cell, : columns * cell].reshape(rows, cell, columns, cell)
    found = grid.fine_averages(plane)
    assert found.dtype == np.float32
    assert found.shape == (grid.rows, grid.columns)
    np.testing.assert_allclose(found[:rows, :columns], whole.mean((1, 3)), atol=1e-3 if cell <= 4 else FINE)


@pytest.mark.parametrize("cell", [4, 8, 16])
def test_noise_does_not_become_brighter(cell):
    """A halving rounds up: three of them alone would add 0.4."""
    image = random_image(1024, 1024)
    assert abs(CellGrid(1024, 1024, cell).averages(image).mean() - image.mean()) < 0.15


def test_cameras_of_different_sizes_are_stacked_as_rgb():
    images = [random_image(64, 48, 1), random_image(40, 60, 2)]
    grids = tuple(CellGrid.from_depth(image.shape[1], image.shape[0], 3) for image in images)
    cells = stack_cells(images, grids)
    assert cells.shape == (2, max(g.rows for g in grids), max(g.columns for g in grids), 3)
    for k, (image, grid) in enumerate(zip(images, grids, strict=True)):
        np.testing.assert_array_equal(cells[k, : grid.rows, : grid.columns, ::-1], grid.averages(image))


def test_an_image_of_another_size_is_refused():
    with pytest.raises(ValueError, match="48x64"):
        stack_cells([random_image(48, 64)], (CellGrid.from_depth(64, 48, 3),))
