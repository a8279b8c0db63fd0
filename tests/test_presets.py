"""Presets: every number of the paper's as it reaches the tracker, and both ways to compose settings."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from command_line import actor_file, trackable
from hydra import compose, initialize_config_dir
from slow_values import fast_and_slow
from small_recording import frame_image, write_image

from sogjax.cli.sweep.run import register_schema
from sogjax.cli.words import composed
from sogjax.energy.priors import RestPenalty
from sogjax.io.actor_file import load_body
from sogjax.run import build
from sogjax.run.background import learn_background
from sogjax.run.clip import Clip
from sogjax.run.recordings import opened, upright
from sogjax.scene.cells import CellGrid
from sogjax.settings.compose import as_object, track_config
from sogjax.settings.files import choices_of, conf_dir
from sogjax.settings.run import TrackConfig
from sogjax.solve.ascent import ConditionedAscent
from sogjax.tracking.frame import TrackState

GROUPS = ("solver", "color", "images", "energy")


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return opened(str(trackable(tmp_path_factory.mktemp("presets") / "r")), None)


def tracker_of(recording, tmp_path, *words):
    config = track_config(["recording=x", *words])
    build.check(config)
    body = upright(load_body(actor_file(tmp_path / "actor.yaml")), recording)
    clip = Clip(recording, recording.frames, config.images.depth)
    return build.tracker(clip, learn_background(clip, config.images.background), body, config)


def numbers(**named):
    return {name: pytest.approx(value, rel=1e-6) for name, value in named.items()}


def fields(module, *names):
    return {name: float(getattr(module, name)) for name in names}


def test_only_the_default_keeps_joints_near_rest(recording, tmp_path):
    rest = [term for term in tracker_of(recording, tmp_path).terms if isinstance(term, RestPenalty)]
    assert [float(term.weight) for term in rest] == [pytest.approx(1e-5, rel=1e-6)]
    for words in ("preset=paper", "energy.rest_weight=0"):
        assert not any(isinstance(term, RestPenalty) for term in tracker_of(recording, tmp_path, words).terms)


def test_every_number_of_the_paper_reaches_the_tracker(recording, tmp_path):
    tracker = tracker_of(recording, tmp_path, "preset=paper")
    assert type(tracker.solver) is ConditionedAscent
    found = fields(tracker.solver, "grow", "shrink", "min_iterations", "epsilon")
    assert found == numbers(grow=1.2, shrink=0.5, min_iterations=10, epsilon=0.002)
    similarity, limits, acceleration = tracker.terms
    assert fields(similarity, "weight", "exponent") == numbers(weight=1.0, exponent=1.0)
    assert similarity.capped
    assert (float(limits.weight), float(acceleration.weight)) == (1.0, pytest.approx(0.05, rel=1e-6))
    found = fields(tracker.reader, "color_radius", "color_tolerance")
    assert found == numbers(color_radius=0.15, color_tolerance=0.15)
    assert (tracker.reader.color_space, tracker.reader.box_around) == ("hsv", "last")
    assert tracker.reader.background is None
    assert float(tracker.extrapolation) == 0.5
    assert tracker.pairs == "dense"
    # Pictures as large as the paper's: 162 x 121.5 cells of 8 pixels.
    grid = CellGrid.from_depth(1296, 972, track_config(["recording=x", "preset=paper"]).images.depth)
    assert (grid.columns, grid.rows) == (162, 122)


def test_the_paper_uses_no_plates_where_there_are_some(recording, tmp_path):
    plates = {name: file for name in recording.rig.names for file in [still(tmp_path / f"{name}.png")]}
    recording = replace(recording, background=plates)
    assert tracker_of(recording, tmp_path).reader.background is not None
    assert tracker_of(recording, tmp_path, "preset=paper").reader.background is None


def still(path):
    write_image(path, frame_image(0, 0))
    return path


def test_what_is_named_counts_more_than_a_preset():
    words = ["recording=x", "preset=paper"]
    named = track_config([*words, "solver=lbfgs", "energy=uncapped", "images=grid", "energy.limit_weight=2"])
    assert (named.solver.method, named.energy.capped, named.images.depth) == ("lbfgs", False, 7)
    assert (named.energy.limit_weight, named.energy.overlap_exponent) == (2.0, "printed")
    assert (named.images.background, named.color.space) == ("none", "hsv")
    assert track_config(preset="paper", energy={"limit_weight": 2.0}, recording="x").solver.epsilon == 0.002


def test_the_default_preset_is_the_defaults():
    assert track_config(["recording=x"]) == TrackConfig(recording="x")
    assert track_config(["recording=x", "preset=default"]) == TrackConfig(recording="x")


@pytest.mark.parametrize("preset", fast_and_slow(*choices_of("preset")))
@pytest.mark.parametrize("group", GROUPS)
def test_settings_are_the_same_with_hydra_and_without(preset, group):
    for choice in choices_of(group):
        words = ["recording=x", f"preset={preset}", f"{group}={choice}"]
        assert composed("track", words) == track_config(words) == by_hydra(words)


def by_hydra(words):
    """The settings as Hydra composes them, which checks the members of a sweep so."""
    register_schema()
    with initialize_config_dir(str(conf_dir()), version_base="1.3"):
        return as_object(compose("track", overrides=words), "track")


@pytest.mark.slow
def test_boxes_around_the_last_pose_do_not_follow_the_prediction(recording, tmp_path):
    moved = jnp.asarray([0.3, 0.0, 1.0, 0.0, 0.0])
    state = TrackState(moved, moved.at[0].set(0.0), jnp.asarray(2))
    last, predicted = (
        tracker_of(recording, tmp_path, f"images.box_around={around}") for around in ("last", "predicted")
    )
    stands = replace(last, extrapolation=jnp.asarray(0.0))
    np.testing.assert_array_equal(last.boxes(state), stands.boxes(state))
    assert (np.ptp(predicted.boxes(state), axis=2) >= np.ptp(last.boxes(state), axis=2)).all()
    assert (np.ptp(predicted.boxes(state), axis=2) > np.ptp(last.boxes(state), axis=2)).any()
