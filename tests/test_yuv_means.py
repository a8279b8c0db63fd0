"""Colours of means, against the definition of a video's channels."""

import numpy as np
import pytest

from sogjax.scene.cells import DROPPED, WEIGHTS, rgb_of_means


def channels(rgb, standard, full_range):
    """Brightness and differences of colour of RGB in 0..255, as BT.601 and BT.709 define them."""
    red, blue = WEIGHTS[standard]
    light = rgb @ np.array([red, 1.0 - red - blue, blue])
    differences = (rgb[..., 2] - light) / (2.0 * (1.0 - blue)), (rgb[..., 0] - light) / (2.0 * (1.0 - red))
    if full_range:
        return light, differences[0] + 128.0, differences[1] + 128.0
    return 16.0 + light * 219.0 / 255.0, *(128.0 + part * 224.0 / 255.0 for part in differences)


@pytest.mark.parametrize("standard", ["601", "709"])
@pytest.mark.parametrize("full_range", [False, True])
def test_the_conversion_undoes_the_definition(standard, full_range):
    """But for what FFmpeg drops: half a level for each product."""
    rgb = np.random.default_rng(0).uniform(5.0, 250.0, (20, 30, 3))
    planes = (plane.astype(np.float32) for plane in channels(rgb, standard, full_range))
    found = rgb_of_means(*planes, standard, full_range)
    dropped = DROPPED * (np.array([1.0, 2.0, 1.0]) + (not full_range))
    np.testing.assert_allclose(found, rgb - dropped, atol=0.51)


@pytest.mark.parametrize("value", [0.0, 255.0])
def test_what_is_too_dark_or_bright_is_cut_off(value):
    grey, plane = np.full((2, 3), 128.0, np.float32), np.full((2, 3), value, np.float32)
    np.testing.assert_array_equal(rgb_of_means(plane, grey, grey, "601", False), np.uint8(value))
