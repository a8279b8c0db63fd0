"""Records of passes that a run keeps: exactly what was found, and one sentence where they are damaged."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from command_line import actor_file

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.array_log import ArrayLog
from sogjax.run.actors import Actors, KnownFrame
from sogjax.run.background import Background
from sogjax.run.forward import kept_rows
from sogjax.run.initial_pose import InitialPose
from sogjax.scene.background import BackgroundImage


@pytest.fixture
def actors(tmp_path):
    body = load_body(actor_file(tmp_path / "a.yaml"))
    turned = body.rotated(jnp.asarray([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]))
    kept = Actors((turned,), (KnownFrame(7, np.linspace(-1.0, 1.0, 5), 0.9),), ("the actor is doubtful",))
    kept.save(tmp_path)
    return kept


def test_actors_are_kept_to_the_bit(tmp_path, actors):
    found = Actors.load(tmp_path)
    jax.tree.map(np.testing.assert_array_equal, found.bodies, actors.bodies)
    (known,) = found.known_frames
    np.testing.assert_array_equal(known.pose, actors.known_frames[0].pose)
    assert (known.frame, known.agreement) == (7, 0.9)
    assert found.doubts == actors.doubts == ("the actor is doubtful",)
    assert Actors.load(tmp_path / "elsewhere") is None


@pytest.mark.parametrize("change", [lambda array: None, lambda array: np.zeros(3), lambda array: array.astype(complex)])
def test_an_actor_that_is_not_the_one_of_its_file_is_refused(tmp_path, actors, change):
    path = tmp_path / "actors.npz"
    with np.load(path) as arrays:
        content = dict(arrays)
    content["0_3"] = change(content["0_3"])
    np.savez(path, **{name: array for name, array in content.items() if array is not None})
    with pytest.raises(InputError, match=r"actors\.npz: .*overwrite=true"):
        Actors.load(tmp_path)


def test_an_initial_pose_is_kept_and_one_under_another_name_is_refused(tmp_path):
    InitialPose(4, np.linspace(-1.0, 1.0, 5), "search").save(tmp_path)
    found = InitialPose.load(tmp_path)
    assert (found.frame, found.source) == (4, "search")
    np.testing.assert_array_equal(found.pose, np.linspace(-1.0, 1.0, 5))
    np.savez(tmp_path / "initial_pose.npz", begin=np.zeros(5))
    with pytest.raises(InputError, match=r"initial_pose\.npz: has no array 'pose'"):
        InitialPose.load(tmp_path)


def test_a_background_is_kept_and_so_is_why_there_is_none(tmp_path):
    picture = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    camera = BackgroundImage(picture, np.ones((2, 4), np.float32), np.eye(2, 4, dtype=bool), "clip")
    Background((camera,)).save(tmp_path)
    found = Background.load(tmp_path)
    for name in ("picture", "spread", "known"):
        np.testing.assert_array_equal(getattr(found.cameras[0], name), getattr(camera, name))
    assert found.is_learnt
    Background(None, "nobody moves").save(tmp_path)
    assert Background.load(tmp_path) == Background(None, "nobody moves")


def test_a_background_that_an_earlier_version_kept_is_read(tmp_path):
    camera = BackgroundImage(
        np.zeros((2, 4, 3), np.uint8), np.ones((2, 4), np.float32), np.eye(2, 4, dtype=bool), "clip"
    )
    Background((replace(camera, furnished=True),)).save(tmp_path)
    assert Background.load(tmp_path).cameras[0].furnished
    with np.load(tmp_path / "background.npz") as arrays:
        content = {name: array for name, array in arrays.items() if name != "0.furnished"}
    np.savez(tmp_path / "background.npz", **content)
    assert not Background.load(tmp_path).cameras[0].furnished


@pytest.mark.parametrize("lost", ["reason", "0.picture", "1.picture", "1.learnt"])
def test_a_background_that_misses_a_part_is_refused(tmp_path, lost):
    Background((BackgroundImage.nothing(4, 2),) * 2).save(tmp_path)
    with np.load(tmp_path / "background.npz") as arrays:
        content = {name: array for name, array in arrays.items() if name != lost}
    np.savez(tmp_path / "background.npz", **content)
    with pytest.raises(InputError, match=rf"background\.npz: has no array '{lost}'"):
        Background.load(tmp_path)


def test_a_log_without_all_columns_is_not_gone_on_from(tmp_path):
    ArrayLog(tmp_path / "frames", {}, {"pose": np.zeros((4, 5))}).close()
    assert kept_rows(tmp_path, InitialPose(0, np.zeros(5), "file"), range(4)) is None
