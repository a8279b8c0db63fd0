"""The report: the experiments of the paper's Section 6, and more, as tables and charts beside its figures."""

import csv
import io
import platform
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from omegaconf import OmegaConf

from sogjax import __version__
from sogjax.data.atomic import atomic_path
from sogjax.engine.outputs import results_folder
from sogjax.engine.terminal import say
from sogjax.errors import InputError
from sogjax.settings import OutputsConfig
from sogjax.settings.compose import track_config
from sogjax.study.document import Picture, Section, write_html, write_markdown
from sogjax.study.experiment import Experiment, experiment_names
from sogjax.study.machine import machine_line
from sogjax.study.pictures import experiment_chart, worst_frame
from sogjax.study.record import RunRecord
from sogjax.study.settings import ReportConfig
from sogjax.study.source import Source
from sogjax.study.stated_errors import StatedErrors, kept_stated_errors
from sogjax.study.study import Study
from sogjax.study.summary import RowSummary
from sogjax.study.table import findings, iterations_table, markdown_table, recordings_table
from sogjax.view.charts import calibration_chart

TITLE = "Section 6 again"
CONFIDENCE = "confidence"
"""Beside the experiments of `conf/experiment/`: standard deviations against true errors."""
PACKAGES = ("sogjax", "jax", "jaxlib", "optimistix", "equinox", "numpy", "opencv-python-headless", "matplotlib")


@dataclass(frozen=True)
class Done:
    """One run of the report."""

    experiment: Experiment
    row: str
    source: Source
    record: RunRecord


def write_report(config: ReportConfig) -> list[Path]:
    """Do the runs that are not there yet, and write the report; the files.

    Raises:
        InputError: an experiment or recording that is not there, or a folder that cannot be written.
    """
    names = config.only or [*experiment_names(), CONFIDENCE]
    experiments = [Experiment.named(name) for name in names if name != CONFIDENCE]
    _check_matplotlib()
    with results_folder(Path(config.out)) as out:
        study = Study(out, config.recordings, config.frames, config.overrides, config.do, config.body)
        begin = time.perf_counter()
        done: list[Done] = []
        sections = [_experiment_section(experiment, study, done) for experiment in experiments]
        if not any(not one.record.failed for one in done) and experiments:
            reason = done[0].record.failed if done else "do=false, and none was done before"
            raise InputError(f"{out}: no run worked: {reason}")
        sections += [confidence_section(study)] if CONFIDENCE in names else []
        say(f"runs done or read in {time.perf_counter() - begin:.0f} s")
        sections = [_about(config, done), *sections, _worst(done, config.pictures), _versions(config)]
        write_html(out / "report.html", TITLE, sections)
        files = [out / "report.html", *write_markdown(out / "report.md", TITLE, sections), _write_runs(out, done)]
    return files


def _experiment_section(experiment: Experiment, study: Study, done: list[Done]) -> Section:
    """An experiment's tables, chart and findings; its runs are added to `done`."""
    done += [Done(experiment, row, source, record) for row, source, record in study.records(experiment)]
    rows = study.summary(experiment)
    rows = [row for row in rows if row.by_recording or row.failed]
    chart = experiment_chart(experiment, rows)
    parts = _parts(experiment, rows)
    parts += [experiment.config.remark] if experiment.config.remark and study.is_committed else []
    return Section(experiment.config.title, parts, [chart] if chart else [])


def _parts(experiment: Experiment, rows: Sequence[RowSummary]) -> list[str]:
    config = experiment.config
    if not any(row.by_recording for row in rows):
        return [config.question, *(f"failed, {row.name}: {reason}" for row in rows for reason in row.failed)]
    base = f" All rows: `{' '.join(config.base)}`." if config.base else ""
    script = f" (`python experiments/study.py {experiment.name}`)" if experiment.is_shipped else ""
    parts = [f"{config.question}{script}{base}", markdown_table(experiment, rows)]
    if config.measure == "accuracy":
        parts += ["Mean error on each recording, mm:", recordings_table(experiment, rows)]
    if config.iterations_by_recording:
        parts += ["Iterations a frame on each recording:", iterations_table(experiment, rows)]
    parts += [config.note] if config.note else []
    if config.paper_note:
        parts.append(f"The paper's figures: {config.paper_note}.")
    said = findings(experiment, rows)
    return [
        *parts,
        *(["\n".join(f"- {line}" for line in said)] if said else []),
    ]


def confidence_section(study: Study) -> Section:
    """Whether the standard deviations of the joints are right.

    Raises:
        InputError: a recording that is not there.
    """
    temperature = OutputsConfig().temperature
    results: dict[str, StatedErrors] = {}
    without = []
    for source in map(study.source, study.recordings):
        try:
            results[source.name] = kept_stated_errors(source, temperature, study.overrides)
        except InputError as error:
            without.append(str(error))
    if not results:
        return Section("Confidence", without)
    lines = ["| recording | found / said | below 1 deviation | below 2 | rank correlation |", "|---|---|---|---|---|"]
    for name, result in results.items():
        ratio = result.mean_square_ratio**0.5
        lines.append(
            f"| {name} | {ratio:.2f} | {result.within(1.0):.0%} | {result.within(2.0):.0%} "
            f"| {result.rank_correlation:.2f} |"
        )
    bins = {name: result.binned() for name, result in results.items()}
    said, found = ({name: pair[k] for name, pair in bins.items()} for k in (0, 1))
    chart = calibration_chart(said, found, "Standard deviations of joints")
    return Section(
        "Confidence",
        [
            "Are the standard deviations of the joints right? (`python experiments/confidence.py`) They follow from "
            f"the curvature of the energy with one temperature, `outputs.temperature={temperature:g}`, calibrated on "
            "walk:0. Compared are joints of all frames, without each joint's mean offset in its own frame, which "
            "belongs to the actor. 68 % and 95 % would be expected of a single coordinate, 61 % and 99 % of a distance "
            "in space whose three coordinates are alike.",
            "\n".join(lines),
            *without,
            "A ratio over 1 says that the deviations are too small there, a rank correlation near 0 that they do not "
            "tell which joints are farther off.",
        ],
        [Picture("confidence.png", chart, "What was said and what was found, in eight bins each")],
    )


def _about(config: ReportConfig, done: Sequence[Done]) -> Section:
    seconds = sum({id(one.record): one.record.seconds for one in _different(done)}.values())
    machines = dict.fromkeys(one.record.machine for one in done)
    return Section(
        "What was done",
        [
            f"`{machine_line()}`",
            *([config.note] if config.note else []),
            "- " + "\n- ".join(f"Runs on: {machine}" for machine in machines),
            f"{len(list(_different(done)))} runs of at most {config.frames} frames, {seconds / 60.0:.0f} minutes in "
            "all with compilation and actors. Errors are distances of markers to the truth in millimetres, mean +- "
            "standard deviation over all markers, recordings and frames but the first, in which markers are attached; "
            "joints are not. A marker is lost for a stretch where it is more than 200 mm off for five tracked "
            "frames on end. Intervals are at 95 %, by Student's t with the standard error of a bootstrap over the "
            "recordings; a difference to the reference, taken in the same frames, whose interval holds zero does not "
            "show. Of twenty differences that are none, one shows all the same; and two seeds of one motion are not "
            "quite two recordings. The actor of a recording and its rough pose in the first frame are the same for all "
            "runs. Times are the median of a tracking step from kept cells.",
            "The paper's recordings are not ours: compare how numbers change, not how large they are.",
        ],
    )


def _worst(done: Sequence[Done], count: int) -> Section:
    """The frames with the largest errors, one an experiment at most."""
    usable = [one for one in done if one.experiment.config.measure == "accuracy" and np.isfinite(one.record.mean_mm)]
    ranked = sorted(usable, key=lambda one: -np.nanmax(one.record.errors))
    pictures: list[Picture] = []
    seen: set[str] = set()
    for one in ranked:
        if one.experiment.name not in seen and len(pictures) < count:
            seen.add(one.experiment.name)
            pictures.append(worst_frame(f"{one.experiment.config.title}, {one.row}", one.source, one.record))
    return Section("Worst frames", ["The frame with the largest mean error of an experiment's runs."], pictures)


def _versions(config: ReportConfig) -> Section:
    tree = OmegaConf.structured(track_config(config.overrides, recording="RECORDING"))
    return Section(
        "Configuration and versions",
        [
            "\n".join(f"- {name} {_version(name)}" for name in PACKAGES) + f"\n- Python {platform.python_version()}",
            "What rows do not set is the default; `runs.csv` lists every run, and `runs/KEY.json` holds it.",
            "```\n" + OmegaConf.to_yaml(tree).strip() + "\n```",
        ],
    )


def _write_runs(out: Path, done: Sequence[Done]) -> Path:
    """`runs.csv`: every row on every recording, with its overrides."""
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(
        ["experiment", "row", "recording", "overrides", "error mm", "ms a step", "seconds", "machine", "failed"]
    )
    for one in done:
        numbers = [f"{value:.2f}" for value in (one.record.mean_mm, one.record.step_ms, one.record.seconds)]
        words = " ".join(one.experiment.overrides(one.row))
        writer.writerow(
            [one.experiment.name, one.row, one.source.name, words, *numbers, one.record.machine, one.record.failed]
        )
    with atomic_path(out / "runs.csv") as temporary:
        temporary.write_text(text.getvalue(), encoding="utf-8")
    return out / "runs.csv"


def _different(done: Sequence[Done]) -> Iterator[Done]:
    """Each run once: several experiments may have a row in common."""
    seen: set[str] = set()
    for one in done:
        plan = str(one.record.plan)
        if plan not in seen:
            seen.add(plan)
            yield one


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return __version__ if package == "sogjax" else "not installed"


def _check_matplotlib() -> None:
    """Found out before the runs, not after.

    Raises:
        InputError: matplotlib is not installed.
    """
    if _version("matplotlib") == "not installed":
        raise InputError("a report needs matplotlib; install it with pip install 'sogjax[report]'")
