"""The report: the paper's method and ours in the experiments of its Section 6, then experiments with ours."""

import time
from collections.abc import Callable, Sequence
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.recording_files import GROUND_TRUTH
from sogjax.run.run_folder import results_folder
from sogjax.run.terminal import say
from sogjax.study.document import Section, write_html, write_markdown
from sogjax.study.experiment import Experiment, experiment_names
from sogjax.study.few_cameras import few_cameras_section
from sogjax.study.limb_calibration import limbs_section
from sogjax.study.pictures import worst_section
from sogjax.study.record import Done, write_runs
from sogjax.study.report_sections import (
    about_section,
    experiment_section,
    methods_section,
    own_section,
    versions_section,
)
from sogjax.study.settings import ReportConfig
from sogjax.study.study import Study

TITLE = "Section 6 again"
BESIDE: dict[str, Callable[[Study], Section]] = {"limbs": limbs_section, "few_cameras": few_cameras_section}
"""Beside the experiments of `conf/experiment/`: doubts about limbs against true errors, and keypoints."""


def write_report(config: ReportConfig) -> list[Path]:
    """Do the runs that are not there yet, and write the report; the files.

    Raises:
        InputError: an experiment or recording that is not there, or a folder that cannot be written.
    """
    names = config.only or [*experiment_names(), *BESIDE]
    experiments = [Experiment.named(name) for name in names if name not in BESIDE]
    _check_truth([*config.recordings, *(config.compared or [])])
    with results_folder(Path(config.out)) as out:
        study = Study.from_config(config, out)
        begin = time.perf_counter()
        done: list[Done] = []
        sections = experiment_sections(experiments, study, done)
        if not any(not one.record.failed for one in done) and experiments:
            reason = done[0].record.failed if done else "do=false, and none was done before"
            raise InputError(f"{out}: no run worked: {reason}")
        sections += [section(study) for name, section in BESIDE.items() if name in names]
        say(f"runs done or read in {time.perf_counter() - begin:.0f} s")
        sections += [worst_section(done, config.pictures)] if config.pictures else []
        sections += [about_section(config, done), versions_section()]
        write_html(out / "report.html", TITLE, sections)
        files = [out / "report.html", *write_markdown(out / "report.md", TITLE, sections)]
    return [*files, write_runs(out / "runs.csv", done)]


def experiment_sections(experiments: Sequence[Experiment], study: Study, done: list[Done]) -> list[Section]:
    """The experiments with the paper's method first, then those with ours only; their runs are added to `done`."""
    compared = [experiment_section(one, study, done) for one in experiments if one.compares_methods]
    own = [experiment_section(one, study, done) for one in experiments if not one.compares_methods]
    if not compared:
        return own
    return [methods_section(), *compared, *([own_section()] if own else []), *own]


def _check_truth(recordings: Sequence[str]) -> None:
    """Found out before an actor is made of any recording.

    Raises:
        InputError: a folder without ground truth.
    """
    for path in map(Path, recordings):
        if path.is_dir() and not GROUND_TRUTH.of(path).is_file():
            raise InputError(f"{path}: has no ground_truth.npz; give a recording with ground truth")
