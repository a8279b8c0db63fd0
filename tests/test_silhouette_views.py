"""Masks as Sogs: what matches a body, what repels it, and where they say nothing."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from rig_cases import ring_rig

from sogjax.actor.silhouettes import BACKGROUND_SIMILARITY, PosedPictures, silhouette_views


@pytest.fixture(scope="module")
def views():
    """A camera whose left third is the subject and whose right third is untold, and one without a picture."""
    rig = ring_rig(2, (96, 64))
    mask, untold = np.zeros((64, 96), bool), np.zeros((64, 96), bool)
    mask[:, :32], untold[:, 64:] = True, True
    posed = PosedPictures("pose", {0: np.zeros((64, 96, 3), np.uint8)}, {0: mask}, {0: untold})
    cameras = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), rig.cameras)
    return silhouette_views([posed], cameras, num_blobs=3, depth=5)[0]


@pytest.mark.parametrize(
    ("columns", "similarity"), [((0, 31), 1.0), ((33, 63), BACKGROUND_SIMILARITY), ((65, 95), 0.0)]
)
def test_cells_match_the_body_by_what_masks_say(views, columns, similarity):
    camera = 0
    across = np.asarray(views.images.means)[camera, :, 0]
    inside = np.asarray(views.images.mask)[camera] & (across > columns[0] + 1) & (across < columns[1] - 1)
    assert inside.any()
    np.testing.assert_allclose(np.asarray(views.color_similarities)[camera][:, inside], similarity, atol=1e-6)


def test_a_camera_without_a_picture_says_nothing(views):
    assert not np.asarray(views.color_similarities)[1].any()
