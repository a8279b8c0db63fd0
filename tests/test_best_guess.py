"""Which frame tracking begins in, what is said of it, and when nobody is there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from motion_cases import walking_motion
from run_cases import DOG, pose_request, stand_in_passes, tiny_run

from sogjax.errors import InputError
from sogjax.quality.verdict import verdicts
from sogjax.run import clip_search, judge
from sogjax.run.actors import Actors
from sogjax.run.clip_search import ClipSearch, Guess, best_guess, likeliest, nobody_there
from sogjax.run.initial_pose import InitialPose
from sogjax.run.runner import run_passes
from sogjax.search.found_pose import TRUNK, FoundPose
from sogjax.search.pose_search import unreported


def found(trunk, energy=1.5, share=1.0, **limbs):
    """A pose whose trunk is so likely right."""
    parts = {TRUNK: trunk, **{name.replace("_", " "): likely for name, likely in limbs.items()}}
    return FoundPose(np.zeros(3), energy, 0.1, False, 0.1, parts=parts, share=share)


class Searched(ClipSearch):
    """A search that finds what is given, by frame."""

    results: dict
    asked: list

    def __init__(self, results, names=("anna",)):
        named = lambda name: SimpleNamespace(name=name, path="clip", fps=30.0)
        for key, value in {
            "results": results,
            "asked": [],
            "bodies": [named(name) for name in names],
            "clip": SimpleNamespace(recording=named("clip")),
        }.items():
            object.__setattr__(self, key, value)

    def candidates(self):
        return iter(self.results)

    def guesses(self, frame, report=unreported):
        self.asked.append(frame)
        return [Guess(frame, self.results[frame])]


@pytest.fixture(autouse=True)
def drawn(monkeypatch, tmp_path):
    guesses = []
    monkeypatch.setattr(clip_search, "_write_picture", lambda search, guess, path: guesses.append(guess) or path)
    monkeypatch.setattr(clip_search, "_remedy", lambda clip: "a rough pose")
    return guesses


def test_the_first_frame_whose_trunks_are_sure_counts_whatever_the_limbs(drawn, capsys):
    search = Searched({0: [found(0.5)], 9: [found(0.995, left_arm=0.3)], 18: [found(1.0)]})
    assert best_guess(search).frame == 9
    assert search.asked == [0, 9]
    assert not drawn
    assert "sure but for left arm (" in capsys.readouterr().err


def test_where_none_is_sure_the_likeliest_is_taken_and_said(drawn, capsys, tmp_path):
    search = Searched({0: [found(0.64), found(0.9, share=0.3)], 9: [found(0.95), found(0.3)]}, ("anna", "ben"))
    assert best_guess(search, tmp_path / "guess.png").frame == 0
    assert [guess.frame for guess in drawn] == [0]
    said = capsys.readouterr().err
    assert "no pose is sure in frames 0, 9: tracking begins with the likeliest (frame 0, 64 %)" in said


def test_a_pose_that_lies_on_the_floor_must_be_the_likelier():
    lying = lambda trunk: replace(found(trunk), upright=-0.26)
    search = Searched({0: [found(0.99), found(0.54)], 59: [lying(0.86), found(0.99)]}, ("anna", "ben"))
    assert best_guess(search).frame == 0
    assert best_guess(Searched({0: [found(0.3)], 59: [lying(0.86)]})).frame == 59


def test_several_actors_who_keep_what_they_explain_beside_the_others_are_searched_in_one_frame():
    search = Searched({0: [found(0.01), found(0.02)], 9: [found(1.0), found(1.0)]}, ("anna", "ben"))
    assert best_guess(search).frame == 0
    assert search.asked == [0]
    alone = Searched({0: [found(0.01)], 9: [found(1.0)]})
    assert best_guess(alone).frame == 9


@pytest.mark.parametrize(("numbers", "frames"), [(range(8), [0]), (range(12), [0, 10]), (range(0, 12, 3), [0])])
def test_tracking_begins_in_no_frame_that_is_not_tracked(monkeypatch, numbers, frames):
    """Another frame than those to track is looked at, to see whether its search agrees."""
    guesses, request = [Guess(0, [found(0.2)]), Guess(10, [found(0.9)])], pose_request()
    monkeypatch.setattr(clip_search, "agreed", lambda *given: guesses)
    search = ClipSearch(replace(request.clip, numbers=numbers), request.background, [DOG], request.config)
    monkeypatch.setattr(ClipSearch, "paths", lambda *given: [])
    monkeypatch.setattr(ClipSearch, "_followed_frames", lambda search, frame: range(0, 15, 5))
    assert [guess.frame for guess in search.guesses(0)] == frames


def test_what_shows_no_actor_or_too_few_people_is_refused(drawn):
    nothing = Searched({0: [found(0.0, energy=-0.1)], 9: [found(0.0, energy=0.0)]})
    with pytest.raises(InputError, match="nothing like anna is seen in frames 0, 9"):
        best_guess(nothing)
    alone = Searched(
        {0: [found(0.9), found(0.0, 0.02, 0.01)], 9: [found(0.9), found(0.1, 0.05, 0.04)]}, ("anna", "ben")
    )
    with pytest.raises(InputError, match="nobody is left for ben beside anna in frames 0, 9"):
        best_guess(alone)
    assert len(drawn) == 2


def test_somebody_who_is_seen_in_one_frame_is_there():
    guesses = [Guess(0, [found(0.9), found(0.0, share=0.0)]), Guess(9, [found(0.2), found(0.2, share=0.4)])]
    assert nobody_there(guesses, ["anna", "ben"]) is None
    lost = [Guess(0, [found(0.9, energy=0.0)]), Guess(9, [found(0.1)])]
    assert likeliest(lost).frame == 9


def test_the_confidence_is_kept_with_the_pose(tmp_path):
    pose = InitialPose(7, np.arange(3.0), "search", np.array([0.64, 1.0]))
    pose.save(tmp_path)
    kept = InitialPose.load(tmp_path)
    assert kept is not None
    np.testing.assert_array_equal(kept.confidence, pose.confidence)
    assert kept.frame == 7
    replace(pose, confidence=None).save(tmp_path)
    again = InitialPose.load(tmp_path)
    assert again is not None
    assert again.confidence is None


def test_a_doubtful_begin_is_told_only_where_the_motion_is_doubtful_too():
    motion = walking_motion()
    good = replace(motion, explained=np.full(motion.num_frames, 0.7))
    said = {"anna": "the initial pose was not sure (64%): look at frame 18"}
    verdict = lambda found: verdicts({"anna": found}, {"anna": 0.75}, begun=said)["anna"]
    assert verdict(good).looks_right
    assert said["anna"] in verdict(replace(good, explained=np.full(motion.num_frames, 0.1))).findings


@pytest.mark.parametrize(("likely", "told"), [(0.06, True), (0.5, False), (1.0, False)])
def test_a_begin_that_is_hardly_likely_is_told_whatever_the_motion_looks_like(likely, told):
    begun = InitialPose(18, np.zeros(DOG.skeleton.num_dofs, np.float32), "search", np.array([likely]))
    run = run_passes(tiny_run(actors=Actors((DOG,)), initial_pose=begun), stand_in_passes())
    said = judge.judged_result(run).verdicts["dog"].findings
    assert said == (("the initial pose was not sure (6%): look at frame 18",) if told else ())
