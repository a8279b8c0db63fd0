"""`sogjax track`, from the videos of a recording to the motion of its actors, and `sogjax adjust`, the next step."""

from collections.abc import Sequence

import numpy as np

from sogjax.errors import counted
from sogjax.quality.limb_warnings import doubtful_limbs
from sogjax.run.adjust import adjust_to_folder
from sogjax.run.clock import clocked
from sogjax.run.initial_pose import SOURCES, PoseSource
from sogjax.run.judge import say_verdicts
from sogjax.run.result import RunResult
from sogjax.run.terminal import say
from sogjax.run.track import track_to_folder
from sogjax.settings.run import AdjustConfig, TrackConfig


def run(config: TrackConfig, command: str = "track", pose_sources: Sequence[PoseSource] = SOURCES) -> RunResult:
    """Track into a folder, and print the results; at last how long each stage took.

    Raises:
        InputError: as `track_to_folder`.
    """
    with clocked() as clock:
        result = track_to_folder(config, command, pose_sources)
        _print_evaluation(result)
        if table := result.times.table():
            print(table)
        print(f"iterations                      {np.mean(result.iterations):10.1f} per frame", end="\n\n")
        print(*result.files, sep="\n")
        _say_warnings(result)
        print(f"\n{clock.table()}")
    say_verdicts(result)
    return result


def adjust(config: AdjustConfig) -> RunResult:
    """Adjust the poses of a tracked clip and the shape of its actor together, and print the results as `run` does.

    Raises:
        InputError: as `adjust_to_folder`.
    """
    with clocked() as clock:
        result = adjust_to_folder(config)
        _print_evaluation(result)
        print(*result.files, sep="\n")
        print(f"\n{clock.table()}")
    say_verdicts(result)
    return result


def _print_evaluation(result: RunResult) -> None:
    if result.evaluation is not None:
        print(result.evaluation.table(details=False), end="\n\n")


def _say_warnings(result: RunResult) -> None:
    """Tell what is in doubt on standard error: missing pictures, limbs, and frames in which the solver was stopped."""
    frames = counted(len(result.converged), "frame")
    for camera, count in result.missing.items():
        say(f"warning: {camera} had no picture in {count} of {frames}; the other cameras were used")
    for name, motion in result.motions.items():
        whose = f"{name}'s " if len(result.motions) > 1 else ""
        for limb in doubtful_limbs(motion):
            say(f"warning: {whose}{limb}")
    not_converged = int(np.sum(~result.converged))
    if not_converged:
        say(
            f"warning: {not_converged} of {frames} did not converge within "
            "solver.max_iterations; check them in the overlay"
        )
