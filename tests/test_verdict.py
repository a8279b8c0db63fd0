"""Verdicts: what a run thinks of its own motion."""

import json
from dataclasses import replace

import cv2
import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from body_cases import shipped
from motion_cases import walking_motion
from rig_cases import ring_rig

from sogjax.cli.actor import actor_verdict
from sogjax.io.files import write_json
from sogjax.io.frame_motions import with_hidden
from sogjax.quality.limb_warnings import Limits
from sogjax.quality.remedies import remedies
from sogjax.quality.verdict import Verdict, verdicts, worst_frames
from sogjax.run.forward import say_if_other_subject
from sogjax.run.judge import kept_verdicts
from sogjax.view.overlay import HEIGHT, below_each_other, closeups

CAMERAS = ("left", "right")


def judged(motion, explained=0.7, overlap=0.7):
    """A motion all of whose frames fit as well."""
    count = motion.num_frames
    return replace(
        motion,
        explained=np.full(count, explained),
        overlap=np.full((count, len(CAMERAS)), overlap),
        camera_names=np.array(CAMERAS),
    )


def replace_explained(body, value):
    return eqx.tree_at(lambda b: b.explained, body, jnp.asarray(value, jnp.float32))


def of_one(motion, expected=0.75):
    return verdicts({"anna": motion}, {} if expected is None else {"anna": expected})["anna"]


@pytest.fixture(scope="module")
def walk():
    return walking_motion(num_frames=24)


def test_what_is_explained_as_in_the_example_poses_looks_right(walk):
    found = of_one(judged(walk))
    assert found.looks_right
    assert not found.wrong
    assert found.sentence == "looks right"
    assert found.overlap == dict.fromkeys(CAMERAS, 0.7)


def test_a_good_verdict_that_rests_on_little_says_so(walk):
    assert "without a background or example poses" in of_one(walk, expected=None).sentence
    assert of_one(walk).sentence == of_one(judged(walk), expected=None).sentence == "looks right"


def test_another_subject_is_told_by_how_little_is_explained(walk):
    found = of_one(judged(walk, explained=0.1))
    assert found.wrong
    assert "not the subject: 10.0% explained against 75.0%" in found.sentence
    assert of_one(judged(walk, explained=0.1), expected=None).wrong
    assert not of_one(judged(walk, explained=0.5), expected=None).wrong


def test_a_body_beside_the_foreground_is_told_by_silhouettes(walk):
    assert "silhouettes overlap to 20%" in of_one(judged(walk, overlap=0.2)).sentence
    assert not of_one(judged(walk, overlap=np.nan)).wrong


def test_silhouettes_that_overlap_less_than_usual_must_be_looked_at(walk):
    found, bare = of_one(judged(walk, overlap=0.5, explained=0.55)), "silhouettes overlap to 50% (65 % is usual)"
    assert not found.wrong
    assert found.sentence == f"look at all of it: {bare}"
    why = "though its colours fit: somebody beside it has no actor, or its sizes are wrong"
    assert of_one(judged(walk, overlap=0.5)).sentence == f"look at all of it: {bare}, {why}"
    motion = judged(walk)
    motion.overlap[:, 1] = 0.3
    motion = replace(motion, overlap=np.repeat(motion.overlap, (2, 1), axis=1), camera_names=np.array(["a", "b", "c"]))
    assert of_one(motion).sentence == "look at c: overlaps to 30%, others to 70%"
    motion.overlap[2:, 2] = np.nan  # hidden by what stands in front, but at the beginning
    assert of_one(motion).sentence == "looks right"


def test_frames_that_fit_badly_are_named(walk):
    motion = judged(walk)
    motion.explained[8:13] = 0.2
    found = of_one(motion)
    assert not found.wrong
    assert found.sentence == f"look at frames {walk.frame[8]}-{walk.frame[12]}: the body fits badly"
    assert set(found.worst) & set(walk.frame[8:13].tolist())


def test_joints_at_their_limits_are_named(walk):
    """Unless the limit is where the body rests, or they are there for a while only."""
    motion = judged(walk)
    names = motion.dof_names.tolist()
    pose, half = np.array(motion.pose), motion.num_frames // 2
    for name in ("left_shoulder_twist", "left_elbow", "right_elbow"):
        pose[:, names.index(name)] = 0.0
    pose[: half + 2, names.index("left_shoulder_twist")] = 0.59
    pose[: half - 1, names.index("right_elbow")] = 2.5
    limits = {
        "left_shoulder_twist": Limits(-0.6, 0.6, 0.0),
        "left_elbow": Limits(0.0, 2.4, 0.0),
        "right_elbow": Limits(0.0, 2.5, 0.0),
        "root_tx": Limits(-np.inf, np.inf, 0.0),
    }
    found = verdicts({"anna": replace(motion, pose=pose)}, {"anna": 0.75}, {"anna": limits})["anna"]
    assert found.findings == (
        f"look at left_shoulder_twist, at its limit in {(half + 2) / (2 * half):.0%} of the frames",
    )


def test_another_subject_is_told_at_the_first_frame(capsys):
    body = replace_explained(shipped("human"), 0.7)
    say_if_other_subject([body], np.array([0.5]))
    assert capsys.readouterr().err == ""
    say_if_other_subject([body], np.array([0.01]))
    assert "WARNING: this seems not to be human: 1.0% explained" in capsys.readouterr().err
    say_if_other_subject([replace_explained(body, 0.0)], np.array([0.01]))  # nothing is known of its example poses
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("likely", [0.9, 0.45])
def test_limbs_in_doubt_are_named(walk, likely):
    doubt = np.full((walk.num_frames, 2), 0.25)
    doubt[3:9, 1] = likely
    doubt[15:18, 0] = likely  # for too few frames
    motion = replace(judged(walk), limb_names=np.array(["head", "left arm"]), limb_doubt=doubt)
    told = f"look at frames {walk.frame[3]}-{walk.frame[8]}, left arm"
    assert of_one(motion).sentence == told
    rivalled = of_one(replace(motion, limb_unlike=np.zeros_like(doubt), limb_rival=np.zeros_like(doubt)))
    assert rivalled.sentence == f"{told} (might as well be elsewhere)"
    assert any("sleeves unlike" in each for each in remedies(rivalled))


def test_a_limb_that_things_hide_is_named_with_the_cause_and_nobody_is_called_another_subject(walk):
    hidden = np.zeros((walk.num_frames, 2))
    hidden[3:9, 1] = 0.95
    doubt = with_hidden(np.zeros_like(hidden), hidden)
    motion = replace(
        judged(walk), limb_names=np.array(["head", "left leg"]), limb_doubt=doubt, limb_hidden=hidden,
        joint_limb=np.zeros(9, int),
    )  # fmt: skip
    found = of_one(motion)
    assert found.sentence == f"look at frames {walk.frame[3]}-{walk.frame[8]}, left leg hidden by what stands in front"
    assert Verdict.from_dict(json.loads(json.dumps(found.as_dict()))) == found
    half = with_hidden(np.full_like(hidden, 0.2), hidden * 0.6)
    assert (half == 0.2).all()  # enough is seen
    part = lambda share: replace(motion, limb_doubt=with_hidden(np.zeros_like(hidden), np.full_like(hidden, share)))
    assert of_one(part(0.89)).looks_right
    assert not of_one(part(0.91)).looks_right
    rivalled = lambda share: replace(
        part(share), limb_hidden=np.full_like(hidden, share), limb_rival=np.zeros_like(hidden)
    )
    assert of_one(rivalled(0.89)).looks_right  # as without
    assert not of_one(rivalled(0.91)).looks_right
    unseen = replace(motion, explained=np.full(walk.num_frames, 0.01), limb_hidden=np.ones_like(hidden))
    assert not of_one(unseen).wrong
    assert of_one(replace(unseen, limb_hidden=None)).wrong


def test_two_actors_in_one_place_are_told(walk):
    apart = replace(walk, blob_means=walk.blob_means + 1.0)
    assert not any(found.wrong for found in verdicts({"anna": walk, "ben": apart}, {}).values())
    found = verdicts({"anna": walk, "ben": walk}, {})
    assert found["anna"].wrong
    assert found["ben"].wrong
    assert "inside each other in 100% of the frames" in found["anna"].sentence


def test_the_worst_frames_do_not_lie_side_by_side(walk):
    motion = judged(walk)
    motion.explained[4:7] = (0.3, 0.1, 0.3)
    motion.explained[15] = 0.2
    worst = [walk.frame.tolist().index(frame) for frame in worst_frames(motion, count=2)]
    assert worst == [5, 15]


def test_a_motion_that_was_not_judged_has_a_verdict_too(walk):
    found = of_one(replace(walk, explained=None, overlap=None, camera_names=None, limb_doubt=None))
    assert (found.explained, found.overlap, found.looks_right) == (None, {}, True)


@pytest.mark.parametrize("doubtful", [False, True])
def test_verdicts_are_read_as_they_were_written(walk, tmp_path, doubtful):
    motion = judged(walk, overlap=0.5)
    if doubtful:
        doubt = np.full((motion.num_frames, 1), 0.9)
        motion = replace(motion, limb_names=np.array(["left arm"]), limb_doubt=doubt)
    found = {"anna": of_one(motion), "ben": of_one(walk, None)}
    write_json(tmp_path / "metrics.json", {"verdicts": {name: verdict.as_dict() for name, verdict in found.items()}})
    assert kept_verdicts(tmp_path / "metrics.json") == found
    assert bool(found["anna"].doubtful) is doubtful


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"verdicts": null}', '{"verdicts": {"anna": {"actor": "anna"}}}'])
def test_verdicts_that_cannot_be_read_are_none(tmp_path, content):
    assert kept_verdicts(tmp_path / "metrics.json") == {}
    (tmp_path / "metrics.json").write_text(content)
    assert kept_verdicts(tmp_path / "metrics.json") == {}


def test_closeups_show_the_body_in_each_frame(walk, tmp_path):
    rig = ring_rig(6, (160, 120), distance=3.0)
    grey = np.full((120, 160, 3), 90, np.uint8)
    frames = [(int(walk.frame[k]), [grey] * 5 + [None]) for k in (2, 20)]
    drawn = below_each_other([*closeups(frames, rig, [walk]).values()])
    assert drawn.shape[0] == 2 * HEIGHT
    assert np.ptp(drawn, axis=(0, 1)).max() > 100
    cv2.imwrite(str(tmp_path / "closeups.png"), drawn)


LEG = "the left leg of the actor may be anywhere"


@pytest.mark.parametrize(
    ("iou", "explained", "doubtful", "others", "said"),
    [
        (0.86, 0.7, (), 0, "looks right (its example poses explain 70% of it)"),
        (0.86, 0.7, (LEG,), 0, LEG),
        (0.7, 0.7, (LEG,), 2, f"{LEG}; 2 more warnings in its report"),
        (0.6, 0.7, (), 0, "silhouettes agree to 60% only"),
        (
            0.86,
            0.2,
            (),
            1,
            "explain 20% of it only (60 to 75 % is usual): look at the colours in its report; 1 warning",
        ),
    ],
)
def test_an_actor_is_judged_by_its_example_poses(iou, explained, doubtful, others, said):
    verdict = actor_verdict(iou, explained, doubtful, others)
    assert verdict == said if doubtful else said in verdict
