"""The runner: takes a run through its passes. What an earlier process finished is read and not done again."""

from collections.abc import Sequence

from sogjax.errors import counted
from sogjax.io.frame_motions import FRAMES
from sogjax.io.frame_table import read_frames_log
from sogjax.run.clock import stage
from sogjax.run.kept_actors import kept_place
from sogjax.run.passes import PASSES, Pass
from sogjax.run.run import Run
from sogjax.run.terminal import say


def run_passes(run: Run, passes: Sequence[Pass] = PASSES) -> Run:
    """Take a run through passes; each record is kept in the run's folder as soon as it is made.

    A run can be stopped at any moment and taken through the same passes again. Records that are there from the
    beginning, as those of actor files, stay.

    Raises:
        InputError: whatever keeps a pass from its end; where frames were tracked, where they lie is said.
    """
    try:
        for each in passes:
            if each.name not in run.records and each.wanted(run):
                run.records[each.name] = _kept(run, each) or _made(run, each)
    except BaseException:
        _say_what_is_left(run)
        raise
    finally:
        run.clip.close()
    return run


def _kept(run: Run, each: Pass) -> object | None:
    """The record that an earlier process kept."""
    if run.kept is None or each.record is None:
        return None
    found = each.record.load(run.kept)
    if found is not None and each.name == "tracked":
        say(f"{run.out}: all of {counted(len(found.table), 'frame')} are tracked; going on after them")
    return found


def _made(run: Run, each: Pass) -> object:
    with stage(each.stage):
        found = each.make(run)
        if run.kept is not None and each.record is not None:
            found.save(run.kept)  # pyright: ignore[reportAttributeAccessIssue]
    return found


def _say_what_is_left(run: Run) -> None:
    """After an error: print where the frames so far are, unless they go with the process."""
    if run.kept is None or run.out is None:
        return
    if "tracked" in run.records:
        say("stopped when all frames were tracked; the same command with resume=true continues")
        return
    found = read_frames_log(run.kept / FRAMES)
    if not found and "actors" in run.records:
        place = kept_place(run.actor_request, run.config.images) if run.makes_actors else None
        if place is not None:
            say(f"the actors are made; the next run takes them from {place}")
    if found is not None and len(found):
        say(
            f"stopped after {counted(len(found), 'frame')}; their motion is in {run.kept}; the same command with "
            "resume=true continues"
        )
