"""What a run thinks of itself: its verdict in numbers and in a line, and a picture of its worst frames."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float

from sogjax.errors import InputError
from sogjax.io.files import atomic_path
from sogjax.io.video import read_frames
from sogjax.model.body import Body
from sogjax.quality.fitted import fitted_numbers
from sogjax.quality.limb_warnings import limits_of
from sogjax.quality.numbers import write_json
from sogjax.quality.verdict import NUM_WORST, Verdict, verdicts
from sogjax.run.run import Run
from sogjax.run.terminal import say
from sogjax.view.closeups import closeups

METRICS, WORST = "metrics.json", "worst.png"


def judge(result: Run) -> None:
    """Note what is thought of each actor's motion."""
    limits = {body.name: limits_of(body) for body in result.bodies}
    result.verdicts = verdicts(result.motions, expected_of(result.bodies), limits)


def say_verdicts(result: Run) -> None:
    """Print in a line each whether the actors' motions look right; a warning where they cannot be relied on."""
    drawn = f"; see {WORST}" if any(path.name == WORST for path in result.files) else ""
    for name, verdict in result.verdicts.items():
        whose = f"{name}: " if len(result.verdicts) > 1 else ""
        if verdict.wrong:
            say(f"WARNING: {whose}{verdict.sentence}{drawn}")
        else:
            print(f"\nverdict: {whose}{verdict.sentence}{'' if verdict.looks_right else drawn}")


def say_if_other_subject(bodies: Sequence[Body], explained: Float[np.ndarray, "actor"]) -> None:
    """Warn at the first frame, so that nobody waits for a whole clip of somebody else."""
    expected = expected_of(bodies)
    for body, share in zip(bodies, explained.tolist(), strict=True):
        if share < fitted_numbers().verdict.other_subject * expected.get(body.name, 0.0):
            say(
                f"WARNING: this seems not to be {body.name}: {share:.1%} explained in the first frame, against "
                f"{expected[body.name]:.1%} in the example poses; Ctrl-C stops, and what is wrong is told at the end"
            )


def expected_of(bodies: Sequence[Body]) -> dict[str, float]:
    """How much of each actor its example poses explain, where that is known."""
    return {body.name: float(body.explained) for body in bodies if float(body.explained) > 0.0}


def write_metrics(path: Path, result: Run) -> None:
    """Write the comparison with the truth, if there is one, and the verdicts."""
    compared: dict[str, Any] = {} if result.evaluation is None else result.evaluation.as_dict()
    write_json(path, compared | {"verdicts": {name: found.as_dict() for name, found in result.verdicts.items()}})


def kept_verdicts(path: Path) -> dict[str, Verdict]:
    """What `write_metrics` wrote of the actors; nothing where that cannot be read."""
    try:
        kept = json.loads(path.read_text(encoding="utf-8"))["verdicts"]
        return {name: Verdict.from_dict(found) for name, found in kept.items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return {}


def write_worst(path: Path, result: Run) -> bool:
    """Write a picture of the frames that fit worst; whether that could be done, which is said otherwise."""
    frames = _worst(result)
    try:
        drawn = closeups(_pictures(result, frames), result.recording.rig, list(result.motions.values()))
    except InputError as error:
        say(f"warning: no {path.name}: {error}")
        return False
    with atomic_path(path) as temporary:
        temporary.write_bytes(cv2.imencode(".png", drawn)[1].tobytes())
    return True


def _worst(result: Run) -> list[int]:
    """The worst frames of all actors in turn, each once, in the order of time."""
    found: dict[int, None] = {}
    for row in range(NUM_WORST):
        found |= {verdict.worst[row]: None for verdict in result.verdicts.values() if row < len(verdict.worst)}
    return sorted(list(found)[:NUM_WORST])


def _pictures(result: Run, frames: Sequence[int]) -> Iterator[tuple[int, list[Any]]]:
    first = result.recording.first_frame
    for frame in frames:
        yield frame, next(iter(read_frames(result.recording, frame - first, frame - first + 1)))
