"""The report: the paper's method and ours in the experiments of its Section 6, then experiments with ours."""

import platform
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.recording_files import GROUND_TRUTH
from sogjax.run.fingerprint import installed_version
from sogjax.run.run_folder import results_folder
from sogjax.run.terminal import say
from sogjax.study.document import Section, write_html, write_markdown
from sogjax.study.experiment import OVERVIEW, Experiment, experiment_names
from sogjax.study.few_cameras import few_cameras_section
from sogjax.study.limb_calibration import limbs_section
from sogjax.study.methods import Rows, comparison_table, overview_table, settings_table
from sogjax.study.pictures import experiment_chart, worst_section
from sogjax.study.record import Done, different, write_runs
from sogjax.study.script import machine_line
from sogjax.study.settings import ReportConfig
from sogjax.study.study import Study
from sogjax.study.summary import RowSummary
from sogjax.study.table import degrees_table, findings, iterations_table, markdown_table, recordings_table

PACKAGES = ("sogjax", "jax", "jaxlib", "optimistix", "equinox", "numpy", "opencv-python-headless", "matplotlib")

READING = (
    "Errors are distances of markers to the truth in millimetres: mean, +- standard deviation over all markers, "
    "recordings and frames. All frames count, as in `metrics.json`: the first one too, in which markers are attached "
    "and their error is 0. Markers are attached by one of two rules: *closest*, Section 6 to the letter (to the joint "
    "of the blob whose centre is closest), beside which the paper's 44.93 mm stand, and *scaled*, ours (the distance "
    "is measured in the blob's sigmas). Where no rule is named it is scaled. Joint errors need no rule. A marker is "
    "lost where it is more than 200 mm off for at least five tracked frames in a row; *lost* counts these stretches.",
    "Intervals are at 95 %, by Student's t with the standard error of a bootstrap over the recordings. A difference "
    "to the reference is taken in the same frames; it is significant if its interval leaves out zero. One in twenty "
    "differences will be significant by chance alone, and two seeds of one motion are not quite two recordings.",
    "The actor of a recording and its rough pose in the first frame are the same for all runs, made with the default "
    "settings. Times are the median of a tracking step from kept cells.",
    "The paper's recordings are not available. Compare how numbers change from row to row, not how large they are.",
)


def about_section(config: ReportConfig, done: Sequence[Done]) -> Section:
    """Where the runs were made, and how to read the tables."""
    seconds = sum({id(one.record): one.record.seconds for one in different(done)}.values())
    frames = max((len(one.record.frame) for one in done), default=0)
    machines = dict.fromkeys(one.record.machine for one in done)
    return Section(
        "How this was made",
        [
            f"`{machine_line()}`",
            *([config.note] if config.note else []),
            "- " + "\n- ".join(f"Runs on: {machine}" for machine in machines),
            f"{len(list(different(done)))} runs of at most {frames} frames, {seconds / 60.0:.0f} minutes in "
            f"all with compilation and actors. {_recordings(done)}",
            *READING,
        ],
    )


def methods_section() -> Section:
    """What the methods are that stand beside each other."""
    text = (
        "Two methods are compared: the paper's, to the letter as far as the paper tells (`docs/guide/the_paper.md` "
        "says how the rest was read), and this project's own, the default. Where a table gives both, a row changes "
        "one setting of each."
    )
    return Section("The two methods", [text, settings_table()])


def versions_section() -> Section:
    """The packages, and where the settings of each run are."""
    return Section(
        "Versions",
        [
            "\n".join(f"- {name} {installed_version(name) or 'not installed'}" for name in PACKAGES)
            + f"\n- Python {platform.python_version()}",
            "What rows do not set is the default; `runs.csv` lists every run, and `runs/KEY.json` holds it with all of "
            "its settings.",
        ],
    )


def _recordings(done: Sequence[Done]) -> str:
    """Which recordings the experiments were run on."""
    slow = dict.fromkeys(one.source.name for one in done if one.experiment.is_slow)
    usual = dict.fromkeys(one.source.name for one in done if not one.experiment.is_slow)
    parts = [f"Experiments with the paper's method, which is slow, were run on {', '.join(slow)}."] if slow else []
    parts += [f"The others were run on {', '.join(usual)}."] if usual else []
    return " ".join(parts)


def experiment_section(experiment: Experiment, study: Study, done: list[Done]) -> Section:
    """An experiment's tables, chart and findings; its runs are added to `done`."""
    for method in experiment.methods:
        done += [Done(experiment, method, *run) for run in study.records(experiment, method)]
    rows = {method: study.summary(experiment, method) for method in experiment.methods}
    chart = experiment_chart(experiment, rows)
    return Section(experiment.config.title, _parts(experiment, rows, study), [chart] if chart else [])


def _parts(experiment: Experiment, rows: Rows, study: Study) -> list[str]:
    config = experiment.config
    parts = [_question(experiment), *([comparison_table(experiment, rows)] if config.methods else [])]
    for method, of_method in rows.items():
        parts += _of_method(experiment, method, of_method)
    parts += [config.note] if config.note else []
    parts += [f"The paper's figures: {config.paper_note}."] if config.paper_note else []
    parts += [config.remark] if config.remark and study.is_committed else []
    return parts


def _question(experiment: Experiment) -> str:
    base = f" All rows: `{' '.join(experiment.config.base)}`." if experiment.config.base else ""
    script = f" (`python experiments/study.py {experiment.name}`)" if experiment.is_shipped else ""
    return f"{experiment.config.question}{script}{base}"


def _of_method(experiment: Experiment, method: str, rows: Sequence[RowSummary]) -> list[str]:
    """What one method's rows say; their table, where none compares the methods."""
    worked, of = [row for row in rows if row.by_recording], f", {method}" if method else ""
    failed = [f"failed{of}, {row.name}: {reason}" for row in rows for reason in row.failed]
    if not worked:
        return failed
    if experiment.name == OVERVIEW:
        parts = [overview_table(worked), "Mean error on each recording, mm:", recordings_table(experiment, worked)]
    else:
        parts = [] if method else [markdown_table(experiment, worked)]
    if experiment.config.iterations_by_recording:
        parts += [f"Iterations per frame on each recording{of}:", iterations_table(experiment, worked)]
    degrees = degrees_table(experiment, worked) if experiment.config.degrees else ""
    parts += [f"Joint angles{of}:", degrees] if degrees else []
    title = f"**{method[:1].upper()}{method[1:]}** (`{' '.join(experiment.methods[method]) or 'preset=default'}`): "
    said = " ".join(findings(experiment, worked))
    return [*parts, *([f"{title if method else ''}{said}"] if said else []), *failed]


TITLE = "Section 6 again"
BESIDE: dict[str, Callable[[Study], Section]] = {"limbs": limbs_section, "few_cameras": few_cameras_section}
"""Sections beside the experiments of `conf/experiment/`: doubts about limbs against true errors, and keypoints."""


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
    heading = "The sections that follow start from the default, `preset=default`."
    return [methods_section(), *compared, *([Section("Experiments with our method", [heading])] if own else []), *own]


def _check_truth(recordings: Sequence[str]) -> None:
    """Found out before an actor is made of any recording.

    Raises:
        InputError: a folder without ground truth.
    """
    for path in map(Path, recordings):
        if path.is_dir() and not GROUND_TRUTH.of(path).is_file():
            raise InputError(f"{path}: has no ground_truth.npz; give a recording with ground truth")
