"""`sogjax track`: from the videos of a recording to the motion of its actors."""

import numpy as np

from sogjax.errors import counted
from sogjax.quality.limb_warnings import doubtful_limbs
from sogjax.run.clock import clocked
from sogjax.run.run import Run
from sogjax.run.terminal import say
from sogjax.run.track import Opening, track_to_folder
from sogjax.run.verdict import say_verdicts
from sogjax.settings.run import TrackConfig


def run(config: TrackConfig, command: str = "track", opening: Opening | None = None) -> Run:
    """Track into a folder, and print the results; at last how long each stage took.

    Raises:
        InputError: as `track_to_folder`.
    """
    with clocked() as clock:
        result = track_to_folder(config, command, opening)
        say_results(result)
        print(f"\n{clock.table()}")
    say_verdicts(result)
    return result


def say_results(result: Run) -> None:
    """Print the tables and the files on standard output, warnings on standard error."""
    if result.evaluation is not None:
        print(result.evaluation.table(details=False), end="\n\n")
    if table := result.times.table():
        print(table)
    print(f"iterations                      {np.mean(result.iterations):10.1f} per frame", end="\n\n")
    for path in result.files:
        print(path)
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
