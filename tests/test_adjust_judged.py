"""An adjusted clip is judged with both its old and its new colours, and what is decided of them is said."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from command_line import trackable
from drawn_scene import in_colors, make_tracker
from frame_table_cases import frame_table

from sogjax.io.recording import open_recording
from sogjax.model.limbs import limb_names
from sogjax.quality.limb_confidence import LimbConfidence
from sogjax.run import adjust_clip, adjust_colors
from sogjax.run.clip import Clip
from sogjax.run.setup import Setup
from sogjax.tracking.frame import FrameInput

FRAMES, DEPTH = 3, 4


@pytest.fixture
def setup(tmp_path):
    """Of a dog before two cameras."""
    recording, body = open_recording(trackable(tmp_path / "clip")), in_colors(shipped("dog"))
    return Setup(Clip(recording, recording.frames[:FRAMES], DEPTH), (body,), make_tracker(body, recording.rig, DEPTH))


@pytest.mark.parametrize(("doubt", "taken"), [(0.1, True), (0.11, True), (0.6, False)])
def test_old_and_new_colours_are_judged_on_the_same_cells_read_once(setup, monkeypatch, doubt, taken):
    (old,) = setup.bodies
    new = in_colors(old, (20.0, 90.0))
    read, ahead = [], []

    def coming():
        for frame in range(FRAMES):
            read.append(frame)
            yield FrameInput(np.zeros((2, 2, 2, 3), np.uint8))

    def judged(tracker, poses, frames):
        count = len(limb_names(tracker.body))
        for at, _ in enumerate(frames):
            ahead.append(len(read) - at)
            told = jnp.full(count, doubt if tracker.body is new else 0.1)
            yield LimbConfidence(told, jnp.zeros((2, old.num_blobs)), jnp.ones(1), jnp.ones((1, 2)))

    monkeypatch.setattr(adjust_colors, "confidence_of_poses", judged)
    table = frame_table(np.zeros((FRAMES, old.skeleton.num_dofs)))
    found, after = adjust_colors.judged_with_colors(setup, new, coming(), table)
    assert read == [*range(FRAMES)]
    assert ahead == [1] * (2 * FRAMES)  # no cells are kept
    assert found.bodies[0] is found.tracker.body is (new if taken else old)
    np.testing.assert_allclose(after.limb_doubt, doubt if taken else 0.1)
    rivals = np.zeros((FRAMES, len(limb_names(old))))
    _, beside = adjust_colors.judged_with_colors(setup, new, coming(), replace(table, limb_rival=rivals))
    np.testing.assert_array_equal(beside.limb_unlike, after.limb_doubt)
    assert (beside.limb_doubt > after.limb_doubt).all()


@pytest.mark.parametrize(("doubt", "more"), [(0.1, False), (0.11, False), (0.6, True)])
def test_new_colours_that_make_a_limb_doubtful_are_told(doubt, more):
    table = frame_table(np.zeros((2, 5)))
    of_limbs = lambda *values: replace(table, limb_doubt=np.tile(np.float32(values), (2, 1)))
    assert adjust_colors.more_doubtful(of_limbs(0.0, doubt), of_limbs(0.1, 0.0)) == more
    assert not adjust_colors.more_doubtful(table, of_limbs(0.1, 0.0))


@pytest.mark.parametrize(
    ("similarity", "taken", "said"),
    [
        (1.05, True, "colours measured anew: 5.0% more similar"),
        (1.05, False, "colours stay: new ones would be 5.0% more similar, but put a limb in doubt"),
        (1.0, False, None),
    ],
)
def test_what_became_of_new_colours_is_said(similarity, taken, said):
    numbers = {"energy_before": 0.1, "energy_after": 0.2, "bone_lengths_changed": {"spine": 0.01}}
    lines = adjust_clip.sentence(numbers | {"similarity_of_new_colors": similarity, "new_colors": taken}).splitlines()
    assert lines[1:] == ([said] if said else [])
