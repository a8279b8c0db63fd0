"""What a run keeps for going on, damaged: one sentence, or it is made anew."""

import jax.numpy as jnp
import numpy as np
import pytest
from command_line import actor_file

from sogjax.errors import InputError
from sogjax.io.actor_file import load_body
from sogjax.io.array_log import ArrayLog
from sogjax.run.kept_run import FOLDER, KeptRun


@pytest.fixture
def kept(tmp_path):
    run = KeptRun(tmp_path)
    run.keep_actors([load_body(actor_file(tmp_path / "a.yaml"))])
    run.keep_start(jnp.linspace(-1.0, 1.0, 5), 0)
    return run


def test_a_first_pose_under_another_name_is_refused(kept):
    np.savez(kept.folder / "start.npz", begin=np.zeros(5))
    with pytest.raises(InputError, match=r"start\.npz: has no array 'start'"):
        kept.start()


@pytest.mark.parametrize("change", [lambda array: None, lambda array: np.zeros(3), lambda array: array.astype(complex)])
def test_an_actor_that_is_not_the_one_of_its_file_is_refused(kept, change):
    path = kept.folder / "actors.npz"
    with np.load(path) as arrays:
        content = dict(arrays)
    content["0_3"] = change(content["0_3"])
    np.savez(path, **{name: array for name, array in content.items() if array is not None})
    with pytest.raises(InputError, match=r"actors\.npz: '0_3' .*overwrite=true"):
        kept.actors()


def test_a_log_without_all_columns_is_not_gone_on_from(kept, tmp_path):
    ArrayLog(tmp_path / FOLDER, {}, {"pose": np.zeros((4, 5))}).close()
    assert kept.prefix(4, 4) is None
