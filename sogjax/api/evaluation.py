"""Motions held against the truth."""

from collections.abc import Sequence
from pathlib import Path
from typing import overload

from sogjax.api.recordings import load_truth
from sogjax.data.ground_truth import GroundTruth
from sogjax.data.motion import Motion
from sogjax.data.recording import Recording
from sogjax.engine.build import marker_rule
from sogjax.errors import InputError
from sogjax.evaluation import Evaluation, GroupEvaluation, MarkerRule, evaluate_motions

Truth = Recording | GroundTruth | str | Path


@overload
def evaluate(motion: Motion, truth: Truth, markers: MarkerRule = ...) -> Evaluation: ...


@overload
def evaluate(motion: Sequence[Motion], truth: Truth, markers: MarkerRule = ...) -> GroupEvaluation: ...


def evaluate(
    motion: Motion | Sequence[Motion], truth: Truth, markers: MarkerRule = "scaled"
) -> Evaluation | GroupEvaluation:
    """How far a motion is from the truth, by virtual markers and joints (Section 6), with swaps of several actors.

    `print` shows the numbers in millimetres; `summary` has them in metres, `markers.errors` (frame, marker) and
    `joints.errors` (frame, joint) every single distance, in metres, NaN where the truth has no value.

    Args:
        motion: one, or a list of those of several actors, whose names are the truth's subjects.
        truth: as `load_truth` takes or gives it: a recording, its folder, a file, or the truth itself.
        markers: how markers are attached, `scaled` (to the blob that is nearest in its own sigmas) or `closest`
            (Section 6 to the letter: nearest by distance).

    Raises:
        InputError: there is no truth, it does not know an actor, or nothing can be compared.
    """
    rule = marker_rule(markers, "markers")
    known = truth if isinstance(truth, GroundTruth) else load_truth(truth)
    if isinstance(motion, Motion):
        name = next(iter(known.subjects)) if len(known.subjects) == 1 else motion.actor or "actor"
        return evaluate_motions({name: motion}, known, rule=rule).evaluations[name]
    if not all(each.actor for each in motion):
        raise InputError("motion: one of several does not say whose it is; set its `actor`")
    return evaluate_motions({each.actor: each for each in motion}, known, rule=rule)
