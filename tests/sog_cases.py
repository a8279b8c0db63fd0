"""Random images, blobs and views for tests of the energy: few sizes, so that little is compiled."""

import jax
import jax.numpy as jnp
import numpy as np
from body_cases import posed

from sogjax.energy.overlap import pair_color_similarities
from sogjax.energy.views import Views, whole_image_overlap
from sogjax.model.sog import Sog

SIZE = 64.0
"""Pixels: the blobs of `random_sog` lie in a square of this side."""


_views = jax.jit(Views.from_images, static_argnums=4)


def floats(values):
    """An array in the working precision."""
    return jnp.asarray(np.asarray(values), jnp.result_type(float))


def random_sog(seed, count, padding=0, sigmas=(2.0, 8.0)):
    """A 2-D Sog of overlapping blobs."""
    rng = np.random.default_rng(seed)
    return Sog.from_arrays(
        floats(rng.uniform(0.0, SIZE, (count, 2))),
        floats(rng.uniform(*sigmas, count)),
        floats(rng.random((count, 3))),
        count + padding,
    )


def similarities(image, body, radius=1.5):
    """Colour similarities, few of which are 0."""
    return pair_color_similarities(image, body, "rgb", floats(radius))


def random_views(cameras, body, seed, count=60, padding=0, color_radius=1.0, sigmas=(3.0, 12.0), pose=None):
    """Views whose image blobs lie about where a body is seen in a pose (default: rest), in colours like its own."""
    rng = np.random.default_rng(seed)
    cameras = jax.tree.map(floats, cameras)
    num_cameras = cameras.image_size.shape[0]
    points = np.asarray(posed(body, body.poses["rest"] if pose is None else pose)[0].means, float)
    images = []
    for k in range(num_cameras):
        world = np.asarray(cameras.camera_from_world[k], float)
        matrix = np.asarray(cameras.intrinsics[k], float)
        chosen = points[rng.integers(0, len(points), count)] @ world[:3, :3].T + world[:3, 3]
        pixels = (chosen / chosen[:, 2:]) @ matrix[:2].T + rng.normal(size=(count, 2)) * 8.0
        colors = np.asarray(body.blob_colors, float)[rng.integers(0, body.num_blobs, count)]
        colors = np.clip(colors + rng.normal(size=(count, 3)) * 0.1, 0.0, 1.0)
        images.append(
            Sog.from_arrays(floats(pixels), floats(rng.uniform(*sigmas, count)), floats(colors), count + padding)
        )
    image = jax.tree.map(lambda *leaves: jnp.stack(leaves), *images)
    normalizers = whole_image_overlap(cameras.image_size)
    blobs = Sog.from_arrays(floats(np.zeros((body.num_blobs, 3))), floats(body.blob_sigmas), floats(body.blob_colors))
    return _views(cameras, image, blobs, normalizers, "rgb", floats(color_radius))


def in_float64(tree):
    """The same tree in double precision; to be called where x64 is enabled."""
    return jax.tree.map(
        lambda leaf: jnp.asarray(np.asarray(leaf, float)) if jnp.issubdtype(leaf.dtype, jnp.floating) else leaf, tree
    )
