"""`sogjax adjust`: the poses of a tracked clip and the shape of its actor, adjusted together."""

from sogjax.run.adjust import adjust_to_folder
from sogjax.run.clock import clocked
from sogjax.run.run import Run
from sogjax.run.verdict import say_verdicts
from sogjax.settings.run import AdjustConfig


def run(config: AdjustConfig) -> Run:
    """Adjust into a folder, and print the results and how long each stage took.

    Raises:
        InputError: as `adjust_to_folder`.
    """
    with clocked() as clock:
        result = adjust_to_folder(config)
        if result.evaluation is not None:
            print(result.evaluation.table(details=False), end="\n\n")
        for path in result.files:
            print(path)
        print(f"\n{clock.table()}")
    say_verdicts(result)
    return result
