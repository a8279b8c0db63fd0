"""Sweeps: `-m` runs every combination of the overrides, or every recording, and ends with a table.

Hydra multiplies the overrides and launches the members, in this process or others. Each member composes its settings
from its own overrides, as a command of its own would, and leaves its result in its folder.
"""

import os
import re
import sys
from collections.abc import Iterator, Sequence
from itertools import islice, product
from pathlib import Path
from typing import Any

import hydra
from hydra.core.config_store import ConfigStore
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.types import Override
from hydra.core.utils import JobReturn, JobStatus
from hydra.errors import HydraException
from hydra.experimental.callback import Callback
from hydra.types import RunMode
from omegaconf.errors import OmegaConfBaseException

from sogjax.cli import track
from sogjax.cli.schemas import SCHEMAS
from sogjax.cli.sweep.folders import with_folders
from sogjax.cli.sweep.results import (
    Failure,
    Member,
    forget_results,
    keep_result,
    keep_row,
    kept_results,
    reason,
    track_take,
)
from sogjax.cli.sweep.tables import finish_sweep
from sogjax.cli.sweep.takes import is_of_takes, track_takes
from sogjax.cli.words import composed, parsed, ready_for_hydra
from sogjax.errors import InputError
from sogjax.run.compile_once import compile_once
from sogjax.run.kept_programs import hold_programs
from sogjax.run.memory import forget_programs_if_many
from sogjax.run.result import Numbers, row_numbers
from sogjax.run.shared import SHARED
from sogjax.run.shared_pose import SWEEP_SOURCES, of_initial_pose
from sogjax.run.terminal import say
from sogjax.settings.compose import no_such_choice, unknown_key
from sogjax.settings.files import conf_dir
from sogjax.settings.run import TrackConfig

PICTURES = ("outputs.overlay", "outputs.rerun", "outputs.page")
"""Outputs of every frame, for which pictures are decoded."""
CHECKED_MEMBERS = 100
"""Members of a sweep that are checked before it begins."""
SEE = "see sogjax track --help"

failures: list[str] = []
"""Why members of the last sweep of this process failed, whatever process they ran in."""


def run_sweep(command: str, overrides: Sequence[str]) -> int:
    """Run a command for every combination of overrides such as `energy.limit_weight=0,1,2`.

    Raises:
        InputError: a command other than track, an invalid override, or a member that failed.
    """
    if command != "track":
        others = ", ".join(name for name in SCHEMAS if name != "track")
        raise InputError(f"{command} -m: only track can be swept, not {others}; leave -m out")
    listed, root = with_folders(overrides)
    words = ready_for_hydra(listed, command, sweep=True)
    if is_of_takes(words, by_pattern=root is not None):
        return track_takes(words, _swept, root)
    return _swept(words, _no_pictures(words))


def _no_pictures(words: Sequence[str]) -> list[str]:
    """What members of a sweep over settings are told besides: no pictures of every frame, unless these are named.

    These take up to four tenths of a later member's time, and the table needs none.
    """
    named = {word.partition("=")[0].lstrip("+~") for word in words}
    others = {"outputs", "outputs.motion_only", "outputs.rerun_images", "outputs.overlay_width"}
    return [] if named & {*PICTURES, *others} else [f"{key}=false" for key in PICTURES]


def _swept(words: Sequence[str], added: Sequence[str] = ()) -> int:
    """Run Hydra with the words of a sweep, after looking at its members; words that are `added` are told."""
    _check_members(words)
    if added:
        asked = " ".join(f"{key}=true" for key in PICTURES)
        say(f"members write no overlay, no Rerun file and no page; {asked} brings them back")
    return run_hydra([*words, *added])


def _check_members(words: Sequence[str]) -> None:
    """Compose the members of a sweep before Hydra makes their folders, and say what they share.

    Raises:
        InputError: an invalid member.
    """
    own = [word for word in words if not word.lstrip("+~").startswith("hydra")]
    try:
        members = list(islice(members_of(parsed(own)), CHECKED_MEMBERS))
    except InputError:
        if len(own) < len(words):  # another sweeper than Hydra's own may understand it
            return
        raise
    _say_shared([composed("track", member) for member in members])


def _say_shared(members: Sequence[TrackConfig]) -> None:
    """Say whether all members begin with one initial pose and one actor, and if not, why."""
    if len(members) < 2 or len({member.recording for member in members}) == len(members):
        return  # of different recordings nobody expects it
    each = [of_initial_pose(member) for member in members]
    changed = [key for key in each[0] if any(other[key] != each[0][key] for other in each)]
    if changed:
        say(f"{', '.join(changed)}: changes what the initial pose is, so members have different ones")
    else:
        say(f"one initial pose{'' if members[0].actor else ' and one actor'} for all {len(members)} members")


def members_of(overrides: Sequence[Override]) -> Iterator[tuple[str, ...]]:
    """Every combination of the overrides' values, as Hydra's own sweeper makes them: the last one varies fastest.

    Raises:
        InputError: an override without a list of values, such as an interval.
    """
    choices: dict[str, list[str]] = {}
    for override in overrides:
        key = override.get_key_element()
        if not override.is_sweep_override():
            choices[key] = [f"{key}={override.get_value_element_as_str()}"]
            continue
        try:
            choices[key] = [f"{key}={value}" for value in override.sweep_string_iterator()]
        except (HydraException, OmegaConfBaseException) as error:
            raise InputError(f"{override.input_line}: name the values, as in {key}=0,1,2 ({SEE})") from error
    return product(*choices.values())


def run_hydra(words: Sequence[str]) -> int:
    """Run the sweep that some words say, which continues when a member fails.

    Raises:
        InputError: a wrong setting of Hydra's own, or a member failed.
    """
    failures.clear()
    register_schema()
    wrong: list[str] = []

    def member(tree: Any) -> Any:
        compile_once()  # in whatever process this is
        hold_programs()
        forget_programs_if_many()
        try:
            return track_member()
        except Exception as error:
            wrong.append(reason(error, "a member of the sweep failed"))
            return Failure(wrong[-1])

    os.environ.setdefault("HYDRA_FULL_ERROR", "1")  # errors come here instead of being printed with a traceback
    program, sys.argv = sys.argv, ["sogjax track", "-m", *words]
    try:
        hydra.main(version_base="1.3", config_path=str(conf_dir()), config_name="track")(member)()
    except (HydraException, OmegaConfBaseException) as error:
        raise InputError(_plain_sentence(error)) from error
    finally:
        sys.argv = program
    wrong = failures or wrong
    if wrong:
        raise InputError(wrong[0] if len(wrong) == 1 else f"{len(wrong)} runs failed; the first: {wrong[0]}")
    return 0


def register_schema() -> None:
    """Make the settings of a track known to Hydra, which checks the keys of a sweep by them."""
    ConfigStore.instance().store(name="schema_track", node=TrackConfig)


def track_member() -> Numbers | dict[str, Any]:
    """Track the member whose job Hydra runs, or one of several recordings, into its own folder; its row's numbers."""
    job: Any = HydraConfig.get()
    config = composed("track", job.overrides.task)
    if takes := job.callbacks.table.get("takes"):
        take = takes[job.job.num]
        return track_take(config, take.actor, Path(take.out), track.run)
    config.out = job.runtime.output_dir
    return row_numbers(track.run(config, pose_sources=SWEEP_SOURCES))


class SweepTable(Callback):
    """Collects the results of a sweep, and prints their table at the end.

    Each member leaves a file in its folder, whatever process it runs in; the table is made from these. `takes` are the
    folders and actors of several recordings by the numbers of the members: their table is made by the command itself,
    since it holds recordings that no member tracks, too.
    """

    def __init__(self, takes: Sequence[Any] | None = None):
        self._takes = takes

    def on_multirun_start(self, config: Any, **kwargs: Any) -> None:
        """Remove the results of an earlier sweep in the same folder."""
        failures.clear()
        SHARED.forget()
        if not self._takes:
            forget_results(Path(config.hydra.sweep.dir))

    def on_job_end(self, config: Any, job_return: JobReturn, **kwargs: Any) -> None:
        """Keep the row of a member that ended."""
        if config.hydra.mode != RunMode.MULTIRUN:
            return
        completed = job_return.status == JobStatus.COMPLETED
        result = job_return.return_value if completed else Failure(job_return._return_value)
        keep = keep_row if self._takes else keep_result
        keep(Path(config.hydra.runtime.output_dir), Member(list(job_return.overrides or []), result))

    def on_multirun_end(self, config: Any, **kwargs: Any) -> None:
        """Print the table; write the CSV and the plot."""
        if self._takes:
            return
        sweep = Path(config.hydra.sweep.dir)
        members = kept_results(sweep)
        failures.extend(member.result for member in members if isinstance(member.result, str))
        finish_sweep(sweep, members)


def _plain_sentence(error: BaseException) -> str:
    """Hydra's error as one sentence with the option, its value and the remedy."""
    causes: list[BaseException] = [error]
    while (cause := causes[-1].__cause__) is not None:
        causes.append(cause)
    text = "\n".join(map(str, causes))
    if found := re.search(r"Could not override '([^']*)'", text):
        return unknown_key(found[1], TrackConfig, SEE)
    if found := re.search(r"Could not find '([^'/]+)/([^']*)'", text):
        return no_such_choice(found[1], found[2], re.findall(r"^\t(\w+)$", text, re.MULTILINE))
    return f"{text.splitlines()[0]} ({SEE})"
