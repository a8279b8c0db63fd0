"""Cameras of different exposure and white balance."""

from dataclasses import replace

import cv2
import jax.numpy as jnp
import numpy as np
import pytest
from drawn_scene import draw
from rig_cases import ring_rig
from small_recording import make_recording, write_image
from tiny_body import make_body

from sogjax.actor.colors import ColoredView, colored, estimated_gains
from sogjax.errors import InputError
from sogjax.io.image_file import evened
from sogjax.io.recording import open_recording
from sogjax.io.video import read_frames, read_still
from sogjax.model.color import from_linear_light, linear_light

GAINS = (0.5, 1.0, 1.6)


def light_of(image):
    """Linear light of a BGR picture, red first."""
    return np.asarray(linear_light(jnp.asarray(image[..., ::-1] / 255.0, jnp.float32)), float)


def test_gains_multiply_light(tmp_path):
    image = np.random.default_rng(0).integers(40, 160, (6, 5, 3)).astype(np.uint8)
    np.testing.assert_allclose(light_of(evened(image, GAINS)), light_of(image) * GAINS, rtol=0.03)
    np.testing.assert_array_equal(evened(image, (1.0, 1.0, 1.0)), image)
    assert evened(image, None) is image
    assert evened(np.full((1, 1, 3), 250, np.uint8), (3.0, 3.0, 3.0)).max() == 255


def test_srgb_and_light_are_inverse_to_each_other():
    """The published values of the standard: middle grey, and the ends."""
    rgb = jnp.linspace(0.0, 1.0, 99).reshape(33, 3)
    np.testing.assert_allclose(from_linear_light(linear_light(rgb)), rgb, atol=1e-6)
    np.testing.assert_allclose(linear_light(jnp.asarray([0.0, 0.5, 1.0])), [0.0, 0.214041, 1.0], atol=1e-5)


def test_every_picture_of_a_camera_is_evened(tmp_path):
    folder = make_recording(tmp_path / "r")
    plate = np.full((48, 64, 3), 90, np.uint8)
    write_image(folder / "background" / "left.png", plate)
    raw = next(iter(read_frames(open_recording(folder))))
    (folder / "recording.yaml").write_text("up: z\ncolor_gains: {left: [0.5, 1.0, 1.6]}\n")
    recording = open_recording(folder)
    left, right = next(iter(read_frames(recording)))
    np.testing.assert_array_equal(left, evened(raw[0], GAINS))
    np.testing.assert_array_equal(right, raw[1])
    np.testing.assert_array_equal(read_still(recording, "left", recording.background["left"]), evened(plate, GAINS))


@pytest.mark.parametrize("gains", ["[1, 1]", "[1, 1, 0]", "[1, 1, 9]", "[1, 1, .nan]", "2"])
def test_gains_with_something_wrong(tmp_path, gains):
    folder = make_recording(tmp_path / "r", settings=f"up: z\ncolor_gains: {{left: {gains}}}\n")
    with pytest.raises(InputError, match=r"color_gains\.left"):
        open_recording(folder)


def dressed():
    """A body in colours of which no channel is dark."""
    body = make_body()
    return colored(body, np.random.default_rng(1).uniform(0.4, 0.7, (body.num_blobs, 3)))


def views_of(body, rig, gains):
    """What each camera sees of the body at rest, with an exposure of its own."""
    pose = body.poses["rest"]
    views = {}
    for camera, (name, image) in enumerate(zip(rig.names, draw(body, pose, rig), strict=True)):
        darker = evened(image, tuple(1.0 / gain for gain in gains[camera]))
        views[camera] = [ColoredView(rig.camera(name), darker, None, pose)]
    return views


def test_the_gains_of_cameras_are_estimated_from_the_colours_of_an_actor():
    rig = ring_rig(4, (320, 240), distance=2.0)
    body = dressed()
    gains = np.array([[1.0, 1.0, 1.0], [1.5, 1.5, 1.5], [1.1, 1.0, 0.8], [1.0, 1.2, 1.0]])
    gains /= np.exp(np.log(gains).mean(axis=0))
    found = estimated_gains(body, views_of(body, rig, gains))
    np.testing.assert_allclose([found[camera] for camera in range(4)], gains, rtol=0.04)


def test_a_camera_that_shows_nothing_keeps_its_colours():
    rig = ring_rig(3, (320, 240), distance=2.0)
    body = dressed()
    views = views_of(body, rig, np.array([[1.2] * 3, [1.0] * 3, [1.0] * 3]))
    views[2] = [replace(view, mask=np.zeros(view.image.shape[:2], bool)) for view in views[2]]
    found = estimated_gains(body, views)
    np.testing.assert_allclose(found[0] / found[1], 1.2, rtol=0.04)
    assert all(np.isfinite(gains).all() for gains in found.values())
    alone = {0: views[0]}
    np.testing.assert_array_equal(estimated_gains(body, alone)[0], np.ones(3))


def test_opencv_reads_what_a_table_makes():
    """Blue comes first in pictures, red in gains."""
    red = np.zeros((2, 2, 3), np.uint8)
    red[..., 2] = 100
    assert cv2.cvtColor(evened(red, (0.25, 1.0, 1.0)), cv2.COLOR_BGR2RGB)[0, 0, 0] < 60
    np.testing.assert_array_equal(evened(red, (1.0, 4.0, 4.0)), red)
