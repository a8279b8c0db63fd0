"""The settings of a report."""

from dataclasses import dataclass

from sogjax.settings.option import expert, group, option

USUAL_FRAMES = 40
"""Frames of each recording that are tracked where neither the study nor the experiment says how many."""


@dataclass
class ReportConfig:
    """Run the experiments of the paper's Section 6 and more, and write report.html and report.md; resumes."""

    out: str = option("outputs/report", "folder for the report and its runs; existing runs are not repeated")
    only: list[str] | None = option(
        None, "experiments, by their names in conf/experiment or as files FOLDER/NAME.yaml; null: all"
    )
    recordings: list[str] = group(
        lambda: [f"{motion}:{seed}" for motion in ("walk", "arms", "squat_kick", "cartwheel") for seed in (0, 1)],
        "folders of recordings with ground truth, or MOTION:SEED of rendered ones",
    )
    compared: list[str] | None = expert(
        None, "recordings of the experiments with the paper's method, which is slow; null: one seed of each motion"
    )
    frames: int | None = option(
        None, "frames of each recording to track, at most; null: 40, or as many as an experiment asks for"
    )
    body: str = option("human", "body that the actors are made from, as for actor")
    overrides: list[str] = group(
        lambda: [], "options of track for all runs, of color, images, energy, solver or tracking: [solver=lbfgs]"
    )
    pictures: int = expert(6, "worst frames to show")
    note: str = expert("", "sentence for the report, such as what else the machine was running")
    overwrite: bool = option(
        False, "accepted as by other commands; the report is replaced in any case, existing runs are kept"
    )
    do: bool = option(True, "run what is missing; false: report on existing runs only")
