"""Sweeps: `-m` runs every combination of the overrides and ends with a table."""

import logging
import os
import sys
from collections.abc import Callable, Sequence
from typing import Any

from sogjax.app.compiled_programs import forget_programs_if_many
from sogjax.app.composition import SCHEMAS, composed, conf_dir, register_schemas, sweep_folder, to_object
from sogjax.app.overrides import plain_sentence, ready_for_hydra
from sogjax.app.sweep_results import COLUMNS, Failure, Numbers
from sogjax.errors import InputError

LOG = logging.getLogger(__name__)

CHECKED_MEMBERS = 100
"""Members of a sweep that are looked at before it begins."""
VMAPPED = "sweep=vmapped"
SWEEP_DIR = "hydra.sweep.dir"


def run_sweep(command: str, overrides: Sequence[str]) -> int:
    """Run a command for every combination of overrides such as `energy.limit_weight=0,1,2`.

    Raises:
        InputError: a command other than track, or an override that cannot be.
    """
    if command != "track":
        others = ", ".join(name for name in SCHEMAS if name != "track")
        raise InputError(f"{command} -m: only track can be swept, not {others}; leave -m out")
    words = ready_for_hydra(overrides, sweep=True)
    if VMAPPED in words:
        return _in_one_call(words)
    _members(words)
    program = sys.argv
    sys.argv = ["sogjax track", "-m", *words]
    try:
        return run_hydra(track_task)
    finally:
        sys.argv = program


def _in_one_call(words: Sequence[str]) -> int:
    """Run the members of a sweep in one compiled call.

    Raises:
        InputError: Hydra is told how to run them.
    """
    from sogjax.app.grid import run_grid

    to_hydra = [word for word in words if _is_hydras(word)]
    for word in to_hydra:
        if not word.startswith(f"{SWEEP_DIR}="):
            raise InputError(
                f"{word}: of Hydra's own settings only {SWEEP_DIR} counts with {VMAPPED}; leave one of the two out"
            )
    members = _members([word for word in words if word not in to_hydra])
    return run_grid(members or [], sweep_folder("track", to_hydra))


def _is_hydras(word: str) -> bool:
    """Whether it is a setting of Hydra's own."""
    return word.lstrip("+~").startswith("hydra")


def _members(words: Sequence[str]) -> list[list[str]] | None:
    """The overrides of every member, composed before Hydra makes their folders; None: only Hydra knows them.

    Raises:
        InputError: a member that cannot be.
    """
    from hydra._internal.core_plugins.basic_sweeper import BasicSweeper
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException

    own = [word for word in words if not _is_hydras(word)]
    try:
        (members,) = BasicSweeper.split_arguments(OverridesParser.create().parse_overrides(own), None)
    except HydraException as error:
        if len(own) < len(words):  # another sweeper than Hydra's own may understand it
            return None
        raise InputError(plain_sentence("track", SCHEMAS["track"], error)) from error
    for member in members[:CHECKED_MEMBERS]:
        composed("track", member)
    return [list(member) for member in members]


def sweep_main(task: Callable[[Any], Any]) -> int:
    """What an experiment's script ends with: run the task as `sys.argv` says; the exit status."""
    words = [word for word in sys.argv[1:] if word not in ("-m", "--multirun")]
    try:
        if task is track_task and VMAPPED in words and len(words) < len(sys.argv) - 1:
            return run_sweep("track", words)
        return run_hydra(task)
    except InputError as error:
        print(f"sogjax: {error}", file=sys.stderr)
        return 2


def run_hydra(task: Callable[[Any], Any]) -> int:
    """Run a task of the track config once, or with `-m` as a sweep, whose other members go on where one fails.

    Raises:
        InputError: an override that cannot be; or the only run has wrong input.
    """
    import hydra
    from hydra.core.hydra_config import HydraConfig
    from hydra.errors import HydraException
    from hydra.types import RunMode
    from omegaconf.errors import OmegaConfBaseException

    from sogjax.app.sweep_callback import failures

    failures.clear()
    register_schemas()
    wrong: list[str] = []

    def member(tree: Any) -> Any:
        forget_programs_if_many()
        try:
            return task(tree)
        except InputError as error:
            wrong.append(str(error))
            return Failure(error)
        except Exception as error:
            if HydraConfig.get().mode != RunMode.MULTIRUN:
                raise
            LOG.exception("a member of the sweep failed")
            wrong.append(f"{type(error).__name__}: {error}")
            return Failure(wrong[-1])

    before = os.environ.get("HYDRA_FULL_ERROR")
    os.environ["HYDRA_FULL_ERROR"] = "1"  # errors come here instead of being printed with a traceback
    try:
        hydra.main(version_base="1.3", config_path=str(conf_dir()), config_name="track")(member)()
    except (HydraException, OmegaConfBaseException) as error:
        raise InputError(plain_sentence("track", SCHEMAS["track"], error)) from error
    finally:
        if before is None:
            del os.environ["HYDRA_FULL_ERROR"]
        else:
            os.environ["HYDRA_FULL_ERROR"] = before
    wrong = failures or wrong
    if wrong:
        raise InputError(wrong[0] if len(wrong) == 1 else f"{len(wrong)} runs failed; the first: {wrong[0]}")
    return 0


def track_task(tree: Any) -> Numbers:
    """One member of a sweep: track into the member's own folder; the numbers of its row."""
    from hydra.core.hydra_config import HydraConfig
    from hydra.types import RunMode

    from sogjax.app import track

    config = to_object("track", tree)
    if not config.out or HydraConfig.get().mode == RunMode.MULTIRUN:
        config.out = HydraConfig.get().runtime.output_dir
    return row_numbers(track.run(config))


def row_numbers(result: Any) -> Numbers:
    """What a sweep's table shows of one run."""
    import numpy as np

    numbers = Numbers(dict.fromkeys(COLUMNS, float("nan")))
    if result.evaluation is not None:
        summary = result.evaluation.summary
        numbers["mean mm"], numbers["std mm"] = 1000.0 * summary.mean, 1000.0 * summary.std
        joints = [e.joints.errors for e in result.evaluation.evaluations.values() if e.joints is not None]
        if joints:
            numbers["joints mm"] = 1000.0 * float(np.nanmean(np.concatenate(joints, axis=1)))
        numbers["swaps"] = len(result.evaluation.swaps)
        numbers["lost"] = sum(len(e.lost) for e in result.evaluation.evaluations.values())
    numbers["iterations"] = float(np.mean(result.iterations))
    numbers["not converged"] = int(np.sum(~result.converged))
    numbers["frames/s"] = result.times.frames_per_second("step")
    return numbers
