"""The simulated detector makes the mistakes it is asked for, no others, and always the same."""

import numpy as np
import pytest
from command_line import done, refused

from sogjax.errors import InputError
from sogjax.io.keypoints.load import load_keypoints
from sogjax.io.keypoints.scheme import named_scheme
from sogjax.io.recording import open_recording
from sogjax.synth.detector import DetectorSettings, Sight, detected
from sogjax.synth.keypoints import biases, files_there, scheme_of, sights
from sogjax.synth.landmarks import KEYPOINTS
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import stage_of

FAULTLESS = {f"keypoint_{name}": 0.0 for name in ("noise", "outliers", "exchanges", "strangers")}
SCHEME = named_scheme("BODY_25")
LEGS = np.array([any(part in name for part in ("hip", "knee", "ankle", "heel", "toe")) for name in SCHEME.landmarks])


def sight(hidden=False, height=1000.0):
    pixels = np.random.default_rng(1).uniform(0.0, height, (1, 25, 2))
    return Sight(pixels, np.ones((1, 25), bool), np.full((1, 25), hidden), np.array([height]))


def many(seen, count=400, **settings):
    """What is found in many pictures; only those with one person."""
    detector = DetectorSettings(**FAULTLESS | settings)
    rng = np.random.default_rng(0)
    return [detected(seen, SCHEME.mirrored, LEGS, detector, rng) for _ in range(count)]


def test_without_mistakes_it_finds_what_is_there():
    for found in many(sight(), 3):
        np.testing.assert_array_equal(found[..., :2], sight().pixels)
        assert (found[..., 2] > 0.1).all()


@pytest.mark.parametrize("height", [1000.0, 250.0])
def test_the_noise_is_as_large_as_the_person(height):
    seen = sight(height=height)
    found = np.stack(many(seen, keypoint_noise=5.0))
    assert np.std(found[..., :2] - seen.pixels) == pytest.approx(5.0 * height / 1000.0, rel=0.03)


def test_shares_of_mistakes_are_those_asked_for():
    seen = sight()
    off = lambda found: np.linalg.norm(np.stack(found)[..., :2] - seen.pixels, axis=-1) > 1.0
    assert off(many(seen, keypoint_outliers=0.2)).mean() == pytest.approx(0.2, abs=0.02)
    exchanged = off(many(seen, keypoint_exchanges=0.3))[:, 0]
    assert exchanged.any(-1).mean() == pytest.approx(0.3, abs=0.07)
    sided = SCHEME.mirrored != np.arange(25)
    assert not exchanged[:, ~sided].any()
    assert {tuple(row[[2, 9]]) for row in exchanged} == {(False, False), (True, False), (False, True), (True, True)}
    assert np.mean([len(found) == 2 for found in many(seen, keypoint_strangers=0.4)]) == pytest.approx(0.4, abs=0.07)
    assert 1 - files_there(DetectorSettings(keypoint_missing=0.33), 0, 0, 4000).mean() == pytest.approx(0.33, abs=0.03)


def test_hidden_keypoints_are_mostly_not_found_and_less_sure():
    hidden, seen = np.stack(many(sight(hidden=True))), np.stack(many(sight()))
    assert (hidden[..., 2] > 0.0).mean() == pytest.approx(0.4, abs=0.03)
    assert hidden[..., 2][hidden[..., 2] > 0.0].mean() < 0.5 < seen[..., 2].mean()


def test_every_keypoint_is_equally_biased():
    offsets = biases(DetectorSettings(keypoint_bias=0.03), 5, 2)
    np.testing.assert_allclose(np.linalg.norm(offsets, axis=-1), 0.03)


def test_what_stands_behind_is_hidden():
    """Cameras on either side of one who faces along x: the nose is hidden from behind, not in front."""
    stage = stage_of(SynthSettings(cameras=4, frames=1, motion="arms"))
    order, shifts = [*KEYPOINTS], np.zeros((1, len(KEYPOINTS), 3))
    seen = list(sights(stage, 0, shifts))
    nose, ears = order.index("nose"), [order.index("left_ear"), order.index("right_ear")]
    assert {bool(one.hidden[0, nose]) for one in seen} == {True, False}
    assert all(one.inside.all() for one in seen)
    # No camera on a ring sees both ears through the head unless it stands before or behind.
    assert any(one.hidden[0, ears].any() for one in seen)
    assert np.mean([one.hidden.mean() for one in seen]) < 0.4
    for view, one in zip(stage.views, seen, strict=True):
        middle = np.array([view.width, view.height]) / 2.0
        assert np.abs(one.pixels[0].mean(0) - middle).max() < 0.3 * view.height
        assert one.heights[0] == pytest.approx(np.ptp(one.pixels[0, :, 1]), rel=0.3)


TINY = ("cameras=2", "frames=3", "width=96", "height=72", "example_poses=false", "background=false", "shadows=false")


@pytest.mark.slow
@pytest.mark.parametrize(("program", "scheme"), [("openpose", "BODY_25"), ("pose2sim", "HALPE_26")])
def test_the_command_writes_them_beside_the_recording(capsys, tmp_path, program, scheme):
    folder = tmp_path / "walk"
    done(capsys, "synth", f"out={folder}", f"keypoints={program}", *TINY)
    recording = open_recording(folder)
    found = load_keypoints(recording)
    assert found is not None
    assert (found.scheme.name, found.points.shape[:2], found.warnings) == (scheme, (2, 3), ())
    done(capsys, "synth", f"out={tmp_path / 'again'}", f"keypoints={program}", *TINY)
    again = load_keypoints(open_recording(tmp_path / "again"))
    np.testing.assert_array_equal(found.points, again.points)
    done(capsys, "synth", f"out={folder}", "overwrite=true", *TINY)
    assert load_keypoints(open_recording(folder)) is None


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["keypoints=openpoze"], "openpoze"),
        (["keypoints=openpose", "keypoint_outliers=1.5"], "keypoint_outliers=1.5"),
        (["keypoints=openpose", "keypoint_noise=-1"], "keypoint_noise=-1"),
        (["keypoints=openpose", "keypoint_bias=2"], "keypoint_bias=2"),
        (["keypoints=openpose", "keypoint_scheme=BODY_26"], "BODY_26"),
    ],
)
def test_wrong_settings_are_refused(capsys, tmp_path, words, said):
    assert said in refused(capsys, "synth", f"out={tmp_path / 'walk'}", *words, *TINY)
    assert not (tmp_path / "walk").exists()


def test_a_scheme_of_other_points_is_refused(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("name: A\ncount: 2\nkeypoints: [{name: T, index: 0, landmark: tail, within: 0}]\n")
    with pytest.raises(InputError, match="'tail'"):
        scheme_of(DetectorSettings(keypoints="openpose", keypoint_scheme=str(path)))
