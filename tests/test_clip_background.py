"""The background of a camera: learnt from a clip only where it was uncovered, and cut into cells."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
from rig_cases import recording_of, ring_rig

from sogjax.errors import InputError
from sogjax.io.example_poses import ExamplePose
from sogjax.run import background, clip_learning
from sogjax.run.background import learn_background, said_if_none
from sogjax.run.clip import Clip
from sogjax.run.shared import SHARED
from sogjax.scene.background import BackgroundImage, background_cells_of, stack_background
from sogjax.scene.cells import CellGrid
from sogjax.scene.clip_background import SampledCamera, even_samples, learnt_background
from sogjax.scene.foreground import foreground_probability
from sogjax.scene.moving_zone import filled
from sogjax.scene.still_body import Standing, still_bodies

SIZE = (128, 96)
RNG = np.random.default_rng(0)


def smooth(seed, low, high):
    """A picture without edges sharper than a few pixels."""
    small = np.random.default_rng(seed).uniform(low, high, (9, 12, 3)).astype(np.float32)
    return cv2.resize(small, SIZE, interpolation=cv2.INTER_CUBIC).clip(0, 255)


EMPTY = smooth(1, 60, 140)
BODY = smooth(2, 150, 250)
PATTERNED = EMPTY + cv2.GaussianBlur(RNG.normal(0.0, 60.0, EMPTY.shape), (0, 0), 1.0)
STILL = (slice(40, 60), slice(56, 64))
"""Part of the body that never moves away."""


def places(num_frames):
    """Left edge of a block that stands at the right for 60 % of the clip, then walks to the left."""
    standing = int(0.6 * num_frames)
    return [90] * standing + [round(90 - 80 * (k + 1) / (num_frames - standing)) for k in range(num_frames - standing)]


def covered(left):
    mask = np.zeros(SIZE[::-1], bool)
    mask[30:70, left : left + 20] = True
    return mask


def film(num_frames=40, light=lambda k: 1.0, shown=covered, shift=lambda k: 0, empty=EMPTY):
    """Pictures by frame, with noise."""
    images = {}
    for k, left in enumerate(places(num_frames)):
        picture = np.where(shown(left)[..., None], BODY, empty)
        noisy = light(k) * np.roll(picture, shift(k), axis=1) + RNG.normal(0.0, 1.5, picture.shape)
        images[k] = np.rint(noisy).clip(0, 255).astype(np.uint8)
    return images


def learnt(images, left_out=None, still=None, mostly=False):
    camera = SampledCamera.from_images(images)
    return learnt_background(camera, filled(np.any(camera.movements, axis=0)), still, left_out, mostly)


def apart(background, light=1.0):
    return np.abs(background.picture.astype(float) - light * EMPTY).max(axis=-1)


def test_what_was_uncovered_is_learnt_though_it_was_hidden_for_longer():
    images = film()
    found = learnt(images)
    assert found.known.mean() > 0.97
    assert (apart(found)[found.known] > 12).mean() < 0.002
    median = np.median(np.stack(list(images.values())), axis=0)
    assert (np.abs(median - EMPTY).max(axis=-1)[covered(90)] > 12).mean() > 0.9  # which a median does not see


@pytest.mark.parametrize(
    ("large", "of_body", "beside"), [(5, False, True), (3, False, True), (2, False, False), (5, True, False)]
)
def test_furniture_is_what_stays_still_beyond_bodies_in_most_cameras(large, of_body, beside):
    where = lambda rows: np.isin(np.arange(20), rows)[:, None] & np.ones((20, 10), bool)
    moving, still = where(range(0, 5)), where(range(5, 15))
    perhaps = still if of_body else where(())
    cameras = range(5)
    still_of = {k: still if k < large else where(()) for k in cameras}
    bodies = {k: Standing(where(()), perhaps) for k in cameras}
    assert clip_learning._beside_furniture(still_of, dict.fromkeys(cameras, moving), bodies) == beside


def test_beside_furniture_what_is_uncovered_for_a_short_time_beyond_an_edge_stays_unknown():
    """A poster behind somebody, or the trousers of one who stood up from before the wall."""
    poster = np.where(covered(96)[..., None], 255.0 - EMPTY, EMPTY)
    images, inside = film(empty=poster), (slice(35, 65), slice(98, 108))
    assert learnt(images).known[inside].mean() > 0.9
    found = learnt(images, mostly=True)
    assert found.known[inside].mean() < 0.1
    assert found.known[covered(60)].all()  # the wall that is seen for most of the time


def test_what_never_changes_amid_movement_is_unknown():
    def with_still_part(left):
        mask = covered(left)
        mask[STILL] = True
        return mask

    found = learnt(film(shown=with_still_part))
    inside = (slice(44, 56), slice(58, 62))
    assert not found.known[inside].any()
    assert (apart(found)[found.known] > 12).mean() < 0.01
    nobody = np.zeros(SIZE[::-1], bool)
    told_apart = learnt(film(shown=with_still_part), still=nobody)
    assert told_apart.known[inside].all()  # where nobody can stand, it is the room


def test_without_the_tracked_body_even_rare_background_is_learnt():
    images = film()
    masks = {k: cv2.dilate(covered(left).astype(np.uint8), np.ones((5, 5))) > 0 for k, left in enumerate(places(40))}
    found = learnt(images, masks)
    assert found.known.mean() > 0.99
    assert (apart(found)[found.known] > 12).mean() < 0.001
    always = {k: covered(90) for k in images}
    assert not learnt(images, always).known[covered(90)].any()


def test_light_that_drifts_or_jumps_is_taken_out_and_counted_as_spread():
    steady, drifting = film(), film(light=lambda k: 0.8 + 0.4 * k / 39)
    found = learnt(drifting)
    assert found.known.mean() > 0.95
    assert (apart(found)[found.known] > 14).mean() < 0.01
    drift = even_samples([*drifting.values()]).drift
    assert 0.08 < np.median(drift / EMPTY.mean(axis=-1)) < 0.16  # standard deviation of 0.8 to 1.2: 0.118
    assert np.median(even_samples([*steady.values()]).drift) < 0.5
    assert np.median(found.spread) > 2 * np.median(learnt(steady).spread)


@pytest.mark.slow
def test_foreground_is_told_from_the_background_and_unknown_is_open():
    found = learnt(film())
    known = found.known.copy()
    known[:10, :10] = False
    picture = film()[0]
    probability = foreground_probability(picture, replace(found, known=known))
    assert np.median(probability[covered(90)]) > 0.95
    assert np.median(probability[~covered(90)]) < 0.05
    np.testing.assert_array_equal(probability[:10, :10], 0.5)


def test_cells_of_a_smaller_background_are_those_of_the_whole_picture():
    grid, other = CellGrid.from_depth(500, 380, 6), CellGrid.from_depth(128, 96, 5)
    large = cv2.resize(EMPTY.astype(np.uint8), (500, 380), interpolation=cv2.INTER_LINEAR)
    small = cv2.resize(large, (250, 190), interpolation=cv2.INTER_AREA)
    plate = BackgroundImage.from_photograph(small)
    known = plate.known.copy()
    known[:, 100:] = False
    cells = stack_background([plate, replace(plate, known=known)], [grid, other])
    assert cells.colors.shape == (2, 48, 63, 3)
    wanted = grid.averages(large)[..., ::-1].astype(int)
    assert np.abs(cells.colors[0].astype(int) - wanted).max() <= 3
    assert cells.known[0].all()
    assert cells.known[1, :24, :12].all()  # 100 of 250 columns are 12.8 of 32 cells
    assert not cells.known[1, :, 14:].any()
    assert not cells.known[1, 24:].any()
    colors, spread, _ = background_cells_of(plate, CellGrid(250, 190, 1))
    np.testing.assert_array_equal(colors, small[..., ::-1])
    np.testing.assert_allclose(spread, plate.spread / 255.0, rtol=1e-5)


def test_edges_of_a_plate_are_less_sure_than_its_planes():
    plate = np.full((20, 20, 3), 50, np.uint8)
    plate[:, 10:] = 200
    spread = BackgroundImage.from_photograph(plate).spread
    assert spread[10, 10] > 4 * spread[10, 2]


def filmed(folder, cameras=2, still=(), **film_settings):
    """A recording, as folders of pictures, the same for all cameras; those in `still` do not shift."""
    rig = ring_rig(cameras, SIZE)
    for k, name in enumerate(rig.names):
        images = film(**(film_settings | ({"shift": lambda k: 0} if k in still else {})))
        (folder / name).mkdir(parents=True)
        for k, image in images.items():
            cv2.imwrite(str(folder / name / f"{k:06d}.png"), image)
    sources = {name: folder / name for name in rig.names}
    offsets = dict.fromkeys(rig.names, 0)
    return replace(recording_of(rig, len(images)), path=folder, sources=sources, frame_offset=offsets)


def of(recording, choice, cache=None):
    """What is learnt, and said where there is nothing; earlier runs of the process are forgotten."""
    SHARED.forget()
    clip = Clip(recording, recording.frames, 8)
    return said_if_none(clip, choice, learn_background(clip, choice, cache)).cameras


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"num_frames": 3}, "3 frames are too few"),
        ({"num_frames": 12, "shown": lambda left: covered(90)}, "nobody moves"),
        ({"num_frames": 12, "shift": lambda k: 4 * (k > 6), "empty": PATTERNED}, "cameras move during the clip .*px"),
    ],
)
def test_unsuitable_clips_are_refused_or_said(tmp_path, capsys, settings, words):
    recording = filmed(tmp_path, **settings)
    with pytest.raises(InputError, match=words):
        of(recording, "clip")
    assert of(recording, "auto") is None
    assert "no background is used" in capsys.readouterr().err


def test_one_moving_camera_is_said_and_only_its_background_stays_unknown(tmp_path, capsys):
    recording = filmed(tmp_path, cameras=3, still=(0, 2), num_frames=20, shift=lambda k: 4 * (k > 10), empty=PATTERNED)
    found = of(recording, "auto")
    assert [background.known.mean() > 0.5 for background in found] == [True, False, True]
    assert not found[1].known.any()
    said = re.search(f"\\({recording.rig.names[1]} by up to ([0-9.]+) px\\)", capsys.readouterr().err)
    assert float(said[1]) == pytest.approx(4.0, abs=1.0)  # blocks of 24 pixels see a little less of a shift of 4


@pytest.mark.slow
def test_a_background_is_kept_in_the_cache_and_made_anew_for_other_frames(tmp_path, capsys):
    recording = filmed(tmp_path / "clip", num_frames=30)
    cache = str(tmp_path / "cache")
    first = of(recording, "clip", cache)
    assert [path.name for path in (tmp_path / "cache").iterdir()] != []
    again = of(recording, "clip", cache)
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.picture, other.picture)
        np.testing.assert_array_equal(one.known, other.known)
    of(replace(recording, num_frames=29), "clip", cache)
    assert "made again" in capsys.readouterr().err


@pytest.mark.slow
def test_who_stands_still_is_looked_for_only_where_no_masks_tell_who_it_is(tmp_path, monkeypatch):
    """Kept backgrounds of both kinds are told apart."""
    asked = []
    monkeypatch.setattr(clip_learning, "still_bodies", lambda *given: asked.append(1) or still_bodies(*given))
    recording, cache = filmed(tmp_path / "clip", num_frames=30), str(tmp_path / "cache")
    of(recording, "clip", cache)
    assert asked == [1]
    name = recording.rig.names[0]
    for masks in ({}, {name: tmp_path / "mask.png"}):
        example = ExamplePose("stand", None, {name: tmp_path / "stand.jpg"}, masks, None)
        with monkeypatch.context() as patch:
            patch.setattr(background, "with_example_plates", lambda _, learnt: (learnt, 0.0))
            of(replace(recording, example_poses=(example,)), "clip", cache)
    assert asked == [1]  # without masks it is the kept one, with masks one without the search
