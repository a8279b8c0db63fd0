"""Sweeps in one compiled call (`sweep=vmapped`): every member tracks the same frames, with numbers of its own."""

import time
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
from omegaconf import OmegaConf

from sogjax.app import build
from sogjax.app.cells import cells_of_clip, pictures_of
from sogjax.app.composition import composed
from sogjax.app.configs import TrackConfig, help_lines
from sogjax.app.first_pose import first_poses, initial_pose_file
from sogjax.app.job import Job, Run, doing, frame_range
from sogjax.app.kept_run import NOTE, read_note
from sogjax.app.made_from import MadeFrom, made_from
from sogjax.app.outputs import export_endings, results_folder, write_results
from sogjax.app.pipeline import FrameTracker, Picture, PictureReader, Preparation
from sogjax.app.recordings import actors_of, file_list, opened, say
from sogjax.app.run_folder import earlier_results, run_folder
from sogjax.app.sweep import SWEEP_DIR, row_numbers
from sogjax.app.sweep_results import Failure, Member, Numbers, finish_sweep, forget_results, keep_result
from sogjax.data.cell_cache import CellsOfClip
from sogjax.data.recording import Recording
from sogjax.data.video import read_prepared
from sogjax.errors import InputError
from sogjax.model.body import Body
from sogjax.sentences import counted
from sogjax.track.many import member, same_program, track_many
from sogjax.track.scan import replayed

NUMBERS = ("color.radius", "images.color_tolerance", "images.box_enlargement", "images.plate_tolerance")
"""What may differ between members beside the energy, the solver and the prediction."""
GROUPS = ("energy.", "solver.", "tracking.")
STEADY = ("gauss_newton", "lbfgs")
"""Solvers that do not magnify rounding: members may look into common boxes, and still find what single runs find."""


def run_grid(members: Sequence[Sequence[str]], sweep: Path) -> int:
    """Track with the overrides of every member, write the results of each, and print the table; the exit status.

    Args:
        members: the overrides of each.
        sweep: the folder of their folders 0, 1, ...

    Raises:
        InputError: anything wrong with the recording, the actors or a config, or a setting that cannot be swept so; or
            a folder that holds results which are to stay.
    """
    configs = [composed("track", list(overrides)) for overrides in members]
    for config in configs:
        build.check(config)
        export_endings(config.outputs)
    check_numbers_only(configs)
    recording = opened(configs[0].recording, configs[0].cameras)
    frame_range(recording, configs[0])
    initial_pose_file(recording, configs[0])
    if configs[0].resume:
        raise InputError("resume=true sweep=vmapped: a sweep in one call cannot go on; leave one of the two out")
    if not configs[0].overwrite:
        check_free(sweep, len(configs))
    with results_folder(sweep) as folder:
        forget_results(folder)
        bodies, made = actors_of(recording, configs[0].actor, configs[0].body, configs[0].color)
        done = []
        for number, running in enumerate(grid_runs(recording, bodies, configs, folder)):
            own = folder / str(number)
            row = _row(running, replace(configs[number], out=str(own)), bodies if made else [])
            done.append(Member(list(members[number]), row))
            keep_result(own, done[-1])
        finish_sweep(folder, done)
    print(folder)
    return 2 if any(isinstance(member.result, Failure) for member in done) else 0


def _row(running: AbstractContextManager[Run], config: TrackConfig, made: list[Body]) -> Numbers | Failure:
    """Write the results of a member; its row of the table: its numbers, or why it failed."""
    try:
        with running as run:
            write_results(run, Path(config.out), config.outputs, OmegaConf.structured(config), made)
            return row_numbers(run)
    except InputError as error:
        say(f"{config.out}: {error}")
        return Failure(error)


def check_free(sweep: Path, count: int) -> None:
    """Refuse a sweep's folder with earlier results, before anything is tracked.

    Raises:
        InputError: the folder of a member holds some.
    """
    for number in range(count):
        found = earlier_results(sweep / str(number), read_note(sweep / str(number) / NOTE))
        if found:
            raise InputError(
                f"{sweep / str(number)}: holds the results of an earlier run ({found[0].name}); choose another folder "
                f"with {SWEEP_DIR}=DIR, or give overwrite=true"
            )


def check_numbers_only(configs: Sequence[TrackConfig]) -> None:
    """Refuse settings that change the pictures, the actors or the files.

    Raises:
        InputError: such a setting differs between the configs.
    """
    for key in differing_keys(configs):
        if key not in NUMBERS and not key.startswith(GROUPS):
            raise _refused(key, configs)


def grid_runs(
    recording: Recording, bodies: list[Body], configs: Sequence[TrackConfig], folder: Path
) -> Iterator[AbstractContextManager[Run]]:
    """The run of every config, tracked in one call, each to be entered while its results are written.

    The files that grow with a run lie in folders 0, 1, ...

    Raises:
        InputError: a setting differs that changes the program.
    """
    jobs = grid_jobs(recording, bodies, configs)
    cells = cells_of_clip(recording, jobs[0].grids, configs[0].images, jobs[0].frames)
    say(f"{counted(len(jobs), 'run')} of {counted(len(cells), 'frame')} in one call")
    begin = time.perf_counter()
    starts = jnp.stack([job.start for job in jobs])
    common_boxes = configs[0].solver.method in STEADY
    clips, capacities = track_many([job.tracker for job in jobs], starts, cells, common_boxes=common_boxes)
    jax.block_until_ready(clips)
    seconds = (time.perf_counter() - begin) / (len(jobs) * len(cells))
    given = None if configs[0].actor is None else bodies
    for number, (job, config) in enumerate(zip(jobs, configs, strict=True)):
        follow = replayed(member(clips, number), capacities, seconds, config.outputs.rerun)
        origin = made_from(recording, config, given)
        yield _one_run(job, config, folder / str(number), origin, reader_of(cells), follow)


@contextmanager
def _one_run(
    job: Job, config: TrackConfig, folder: Path, origin: MadeFrom, read: PictureReader, follow: FrameTracker
) -> Iterator[Run]:
    with run_folder(folder, config.overwrite) as own:
        own.begin("track", origin, [] if config.actor is None else file_list(config.actor))
        with doing(job, config.outputs, own.path, read, follow) as run:
            yield run
            own.finish("track", origin, run.files)
            own.kept.remove()


def grid_jobs(recording: Recording, bodies: list[Body], configs: Sequence[TrackConfig]) -> list[Job]:
    """The jobs of configs that differ in numbers only; what does not depend on these is made once.

    Raises:
        InputError: a setting differs that changes the program.
    """
    first = Job.from_config(recording, bodies, configs[0])
    starts = {_of_start(recording, configs[0]): first.start}
    jobs = []
    for config in configs:
        tracker = build.varied(first.tracker, config)
        if not same_program(tracker, first.tracker):
            raise _refused(_key_of_program(first, configs[0], config), configs)
        key = _of_start(recording, config)
        if key not in starts:
            starts[key] = jnp.concatenate(first_poses(recording, first.bodies, config, first.frames[0]))
        jobs.append(replace(first, tracker=tracker, start=starts[key]))
    return jobs


def reader_of(cells: CellsOfClip) -> PictureReader:
    """Reads a clip's cells from memory; where outputs show the pictures, these from the videos."""

    def read(recording: Recording, preparation: Preparation, first: int, last: int) -> Iterator[list[Picture]]:
        return pictures_of(cells) if preparation.cells_only else read_prepared(recording, preparation, first, last)

    return read


def differing_keys(configs: Sequence[TrackConfig]) -> list[str]:
    """The settings that are not the same in all configs."""
    keys = [key for key, _, _ in help_lines(TrackConfig)]
    return [key for key in keys if any(value_of(c, key) != value_of(configs[0], key) for c in configs)]


def value_of(config: TrackConfig, key: str) -> Any:
    """The value of a setting such as `energy.limit_weight`."""
    value = config
    for part in key.split("."):
        value = getattr(value, part)
    return value


def _of_start(recording: Recording, config: TrackConfig) -> str:
    """What a first pose depends on beside the recording and the actors: nothing, where it comes from a file."""
    if initial_pose_file(recording, config) is not None:
        return ""
    return str([asdict(part) for part in (config.color, config.images, config.energy)])


def _key_of_program(first: Job, base: TrackConfig, config: TrackConfig) -> str:
    """The setting because of which a config needs another program than the first one."""
    tracker = build.varied(first.tracker, base)
    for key in differing_keys([base, config]):
        group, name = key.split(".")
        changed = replace(base, **{group: replace(getattr(base, group), **{name: value_of(config, key)})})
        if not same_program(build.varied(first.tracker, changed), tracker):
            return key
    return "solver.method"


def _refused(key: str, configs: Sequence[TrackConfig]) -> InputError:
    values = ",".join(dict.fromkeys(str(value_of(config, key)) for config in configs))
    return InputError(
        f"{key}={values}: cannot differ within one compiled call, which only numbers of the energy, the solver and the "
        "prediction may; leave sweep=vmapped out, or sweep over it apart"
    )
