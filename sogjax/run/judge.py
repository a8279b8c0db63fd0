"""What a run thinks of itself: its verdict in numbers and in a line, and what its worst frames show."""

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from sogjax.errors import InputError
from sogjax.io.files import write_json
from sogjax.io.ground_truth import load_ground_truth
from sogjax.io.motion import Motion
from sogjax.io.recording import Recording
from sogjax.io.video import read_chosen
from sogjax.quality.evaluation import GroupEvaluation, evaluate_motions
from sogjax.quality.jumps import jumps
from sogjax.quality.limb_warnings import limits_of
from sogjax.quality.passages import passages
from sogjax.quality.proportions import odd_sentence
from sogjax.quality.verdict import NUM_WORST, Verdict, expected_of, verdicts
from sogjax.run.clip_sides import colors_apart, unlike_where_tracked
from sogjax.run.recordings import upright
from sogjax.run.result import RunResult
from sogjax.run.run import Run
from sogjax.run.run_files import PAGE, WORST
from sogjax.run.terminal import say
from sogjax.search.pose_confidence import SURE

HARDLY = 0.1
"""Confidence of an initial pose below which that is told whatever the motion looks like: in all four such runs of
`experiments/whole_runs.py` that were at hand (couples 182 and 373, sits 31 and 61) a joint was astray."""


def judged_result(run: Run) -> RunResult:
    """The result of a run, with the comparison with a truth, if there is one, and with what the run thinks of it."""
    result = run.result_so_far
    limits = {body.name: limits_of(body) for body in result.bodies}
    doubts = dict(zip((body.name for body in run.actors.bodies), run.actors.doubts, strict=False))
    sides = _sides(run, result)
    hardly, begun = _doubtful_begin(run)
    told = lambda body: (doubts.get(body.name), odd_sentence(body), sides.get(body.name), hardly.get(body.name))
    odd = {body.name: [said for said in told(body) if said] for body in result.bodies}
    moved = {body.name: (body, result.motions[body.name]) for body in result.bodies}
    limbs = {name: [*jumps(*of_body), *passages(*of_body)] for name, of_body in moved.items()}
    return replace(
        result,
        evaluation=compared(result.recording, result.motions),
        verdicts=verdicts(result.motions, expected_of(result.bodies), limits, begun, odd, limbs),
    )


def _sides(run: Run, result: RunResult) -> dict[str, str | None]:
    """Which limbs of actors whose limbs were found in frames that nobody chose are of other colours in the motion.

    Nothing where the videos cannot be read once more, which is said.
    """
    if not run.actors.unlike or run.clip.recording.example_poses:
        return {}
    recording = result.recording
    actors = {body.name: (upright(body, recording), result.motions[body.name]) for body in result.bodies}
    try:
        apart = colors_apart(recording, actors, run.actor_request.color_space)
    except InputError as error:
        say(f"warning: the colours of left and right are not compared: {error}")
        return {}
    return {name: unlike_where_tracked(of_actor) for name, of_actor in apart.items()}


def _doubtful_begin(run: Run) -> tuple[dict[str, str], dict[str, str]]:
    """What is said of each actor whose initial pose was hardly likely, and of others for whom it was not sure."""
    start = run.initial_pose if run.tracks else None
    if start is None or start.confidence is None:
        return {}, {}
    names, likely = [body.name for body in run.actors.bodies], start.confidence.tolist()
    sentence = "the initial pose was not sure ({:.0%}): look at frame {}"
    said = lambda low, high: {
        name: sentence.format(share, start.frame)
        for name, share in zip(names, likely, strict=True)
        if low <= share < high
    }
    return said(0.0, HARDLY), said(HARDLY, SURE)


def compared(recording: Recording, motions: Mapping[str, Motion]) -> GroupEvaluation | None:
    """The comparison with the recording's ground truth; None: there is none, or none that fits, which is said."""
    if recording.ground_truth is None:
        return None
    truth = load_ground_truth(recording.ground_truth)
    if len(motions) > 1 and not set(motions) <= set(truth.subjects):
        say(f"warning: {recording.ground_truth} knows {', '.join(truth.subjects)}; nothing was compared")
        return None
    try:
        return evaluate_motions(motions, truth)
    except InputError as error:
        say(f"warning: not compared with the truth: {error}")
        return None


def say_verdicts(result: RunResult) -> None:
    """Print in a line each whether the actors' motions look right; a warning where they cannot be relied on."""
    written = {path.name for path in result.files}
    drawn = next((f"; see {each.name}" for each in (PAGE, WORST) if each.name in written), "")
    for name, verdict in result.verdicts.items():
        whose = f"{name}: " if len(result.verdicts) > 1 else ""
        if verdict.wrong:
            say(f"WARNING: {whose}{verdict.sentence}{drawn}")
        else:
            print(f"\nverdict: {whose}{verdict.sentence}{'' if verdict.looks_right else drawn}")


def write_metrics(path: Path, result: RunResult) -> None:
    """Write the comparison with the truth, if there is one, and the verdicts."""
    errors: dict[str, Any] = {} if result.evaluation is None else result.evaluation.as_dict()
    write_json(path, errors | {"verdicts": {name: found.as_dict() for name, found in result.verdicts.items()}})


def kept_verdicts(path: Path) -> dict[str, Verdict]:
    """What `write_metrics` wrote of the actors; nothing where that cannot be read."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))["verdicts"]
        return {name: Verdict.from_dict(found) for name, found in kept.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def worst_images(result: RunResult) -> dict[int, list[Any]]:
    """The pictures (BGR) of all cameras in the frames that fit worst; none where they cannot be read, which is said."""
    try:
        return dict(read_chosen(result.recording, _worst(result)))
    except InputError as error:
        say(f"warning: no {WORST.name}: {error}")
        return {}


def _worst(result: RunResult) -> list[int]:
    """The worst frames of all actors in turn, each once, in the order of time."""
    found: dict[int, None] = {}
    for row in range(NUM_WORST):
        found |= {verdict.worst[row]: None for verdict in result.verdicts.values() if row < len(verdict.worst)}
    return sorted(list(found)[:NUM_WORST])
