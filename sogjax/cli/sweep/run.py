"""Sweeps: `-m` runs every combination of the overrides and ends with a table."""

import logging
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from itertools import islice, product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sogjax.cli.config.composition import SCHEMAS, composed, register_schemas
from sogjax.cli.config.overrides import plain_sentence, ready_for_hydra
from sogjax.cli.sweep.folders import root_of, with_folders
from sogjax.cli.sweep.results import Failure
from sogjax.cli.sweep.take_table import track_take
from sogjax.cli.sweep.takes import is_of_takes, track_takes
from sogjax.errors import InputError
from sogjax.run.memory import forget_programs_if_many
from sogjax.run.run_numbers import Numbers, row_numbers
from sogjax.run.shared_start import of_first_pose, shared_opening
from sogjax.run.terminal import say
from sogjax.settings.compose import as_object
from sogjax.settings.files import conf_dir
from sogjax.settings.run import TrackConfig

if TYPE_CHECKING:
    from hydra.core.override_parser.types import Override

LOG = logging.getLogger(__name__)

PICTURES = ("outputs.overlay", "outputs.rerun")
"""Outputs of every frame, for which pictures are decoded."""
CHECKED_MEMBERS = 100
"""Members of a sweep that are checked before it begins."""


def run_sweep(command: str, overrides: Sequence[str]) -> int:
    """Run a command for every combination of overrides such as `energy.limit_weight=0,1,2`.

    Raises:
        InputError: a command other than track, or an invalid override.
    """
    if command != "track":
        others = ", ".join(name for name in SCHEMAS if name != "track")
        raise InputError(f"{command} -m: only track can be swept, not {others}; leave -m out")
    folders = with_folders(overrides)
    words = ready_for_hydra(folders, command, sweep=True)
    if is_of_takes(words, by_pattern=folders != [*overrides]):
        return track_takes(words, _swept, root_of(overrides))
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
        say(f"members write no overlay and no Rerun file; {asked} brings them back")
    program = sys.argv
    sys.argv = ["sogjax track", "-m", *words, *added]
    try:
        return run_hydra(track_task)
    finally:
        sys.argv = program


def _is_hydras(word: str) -> bool:
    """Whether it is one of Hydra's own settings."""
    return word.lstrip("+~").startswith("hydra")


def _check_members(words: Sequence[str]) -> None:
    """Compose the members of a sweep before Hydra makes their folders.

    Raises:
        InputError: an invalid member.
    """
    from hydra.core.override_parser.overrides_parser import OverridesParser
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    own = [word for word in words if not _is_hydras(word)]
    try:
        members = list(islice(_members(OverridesParser.create().parse_overrides(own)), CHECKED_MEMBERS))
    except (HydraException, OmegaConfBaseException) as error:
        if len(own) < len(words):  # another sweeper than Hydra's own may understand it
            return
        raise InputError(plain_sentence("track", SCHEMAS["track"], error)) from error
    _say_shared([composed("track", member) for member in members])


def _say_shared(members: Sequence[TrackConfig]) -> None:
    """Say whether all members begin with one first pose and one actor, and if not, why."""
    if len(members) < 2:
        return
    each = [of_first_pose(member) for member in members]
    if len({member.recording for member in members}) == len(members):
        return  # nobody expects them to share
    changed = [key for key in each[0] if any(other[key] != each[0][key] for other in each)]
    if changed:
        say(f"{', '.join(changed)}: changes what the first pose is, so members have different ones")
    else:
        say(f"one first pose{'' if members[0].actor else ' and one actor'} for all {len(members)} members")


def _members(overrides: "Sequence[Override]") -> Iterator[tuple[str, ...]]:
    """Every combination of the overrides' values, as Hydra's own sweeper makes them: the last one varies fastest.

    Raises:
        HydraException: an override without a list of values, such as an interval.
    """
    from hydra.errors import HydraException

    choices: dict[str, list[str]] = {}
    for override in overrides:
        key = override.get_key_element()
        if not override.is_sweep_override():
            choices[key] = [f"{key}={override.get_value_element_as_str()}"]
        elif override.is_discrete_sweep():
            choices[key] = [f"{key}={value}" for value in override.sweep_string_iterator()]
        else:
            raise HydraException(f"{override.input_line}: name the values, as in {key}=0,1,2")
    return product(*choices.values())


def run_hydra(task: Callable[[Any], Any]) -> int:
    """Run a task of the track settings as the sweep that `sys.argv` says, which continues when a member fails.

    Raises:
        InputError: an invalid override, or a member failed.
    """
    import hydra
    from hydra.errors import HydraException
    from omegaconf.errors import OmegaConfBaseException

    from sogjax.cli.sweep.callback import failures

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


def track_task(tree: Any) -> Numbers | dict[str, Any]:
    """Track one member of a sweep, or one of several recordings, into its own folder; the numbers of its row."""
    from hydra.core.hydra_config import HydraConfig

    from sogjax.cli import track

    config = as_object(tree, "track")
    hydras: Any = HydraConfig.get()
    if takes := hydras.callbacks.table.get("takes"):
        take = takes[hydras.job.num]
        return track_take(config, take.actor, Path(take.out), track.run)
    config.out = hydras.runtime.output_dir
    return row_numbers(track.run(config, opening=shared_opening))
