"""What is kept of the runs of a study: a JSON file each, by which a run is not done again, and their list."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float, Int

import sogjax
from sogjax.io.files import csv_text, write_file
from sogjax.settings.option import telling_settings
from sogjax.settings.run import TrackConfig
from sogjax.study.experiment import Experiment
from sogjax.study.source import Source

RECORD_VERSION = 3
"""A number to be raised with every change that makes earlier runs incomparable."""
_DECIDE = ("model", "solve", "energy", "scene", "tracking", "search", "quality", "actor", "refine", "io", "run")
"""Packages whose code decides the result of a run."""
_ELSEWHERE = ("recording", "cameras")
"""Settings that a plan has by other names."""


@dataclass(frozen=True)
class RunPlan:
    """All that decides how a run comes out; its `key` names the file."""

    recording: str
    """The study's name of the recording, which for a rendered one holds its settings."""
    frames: int
    cameras: list[str]
    measure: str
    config: dict[str, Any]
    """The track config by key, without what has no say in the result."""

    @classmethod
    def of(cls, recording: str, frames: int, cameras: tuple[str, ...], measure: str, config: TrackConfig) -> "RunPlan":
        """A plan for a track config."""
        kept = {key: value for key, value in telling_settings(config).items() if key not in _ELSEWHERE}
        return cls(recording, frames, list(cameras), measure, kept)

    @property
    def key(self) -> str:
        """Sixteen letters that differ where anything differs, the program's own files included."""
        return key_of(RECORD_VERSION, version("sogjax"), program_digest(), asdict(self))


@dataclass
class RunRecord:
    """One run: what was tracked and how, and what came of it. Lists have a value for every frame."""

    plan: dict[str, Any]
    machine: str
    """Processor, versions and date."""
    frame: list[int] = field(default_factory=list)
    error_mm: list[float] = field(default_factory=list)
    """Mean distance of the markers (of the joints where there are no markers), attached by the rule `scaled`; NaN:
    nothing to compare with."""
    closest_mm: list[float] = field(default_factory=list)
    """Mean distance of the markers by the rule `closest`, of Section 6."""
    joint_error_mm: list[float] = field(default_factory=list)
    std_mm: float = float("nan")
    """Over all distances of `error_mm`."""
    closest_std_mm: float = float("nan")
    angles: list[dict[str, Any]] = field(default_factory=list)
    """Errors of joint angles, all actors': the fields of `AngleError`."""
    lost: int = 0
    """Stretches of frames with a lost marker."""
    swaps: int = 0
    iterations: list[int] = field(default_factory=list)
    evaluations: list[int] = field(default_factory=list)
    converged: list[bool] = field(default_factory=list)
    milliseconds: list[float] = field(default_factory=list)
    """Milliseconds of the tracking step; the first frame's hold the compilation."""
    image_blobs: float = float("nan")
    """Used in a frame by a camera."""
    pose: list[list[float]] = field(default_factory=list)
    rates: dict[str, float] = field(default_factory=dict)
    """Frames per second by stage, if the speed was measured."""
    seconds: float = float("nan")
    """Seconds that the whole run took, with compilation and, where it was the first of its recording, the actor."""
    failed: str = ""
    """Why there is no result."""

    @property
    def errors(self) -> Float[np.ndarray, "frame"]:
        """`error_mm` as an array."""
        return np.asarray(self.error_mm, float)

    @property
    def frames(self) -> Int[np.ndarray, "frame"]:
        """`frame` as an array."""
        return np.asarray(self.frame, int)

    @property
    def mean_mm(self) -> float:
        """The mean of the frames that have an error; NaN where none has."""
        present = self.errors[np.isfinite(self.errors)]
        return float(present.mean()) if present.size else float("nan")

    @property
    def closest_mean_mm(self) -> float:
        """The mean over the frames by the rule `closest`."""
        present = np.asarray(self.closest_mm, float)
        present = present[np.isfinite(present)]
        return float(present.mean()) if present.size else float("nan")

    @property
    def step_ms(self) -> float:
        """Median time of a tracking step without the first frame, which compiles."""
        return float(np.median(self.milliseconds[1:])) if len(self.milliseconds) > 1 else float("nan")


def key_of(*content: Any) -> str:
    """Sixteen letters that name a file of what was kept, and differ where anything that decides it differs."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:16]


@cache
def program_digest(further: str = "") -> str:
    """The digest of those files of the program that decide how a run comes out, and of `further` ones (a pattern)."""
    package = Path(sogjax.__file__).parent
    more = package.glob(further) if further else []
    kinds = ("*.py", "*.yaml")  # numbers that were fitted, and bodies, decide as the code does
    files = sorted({*more, *(path for name in _DECIDE for kind in kinds for path in (package / name).rglob(kind))})
    content = hashlib.sha256()
    for path in files:
        content.update(f"{path.relative_to(package)}\n".encode() + path.read_bytes())
    return content.hexdigest()[:16]


class RunFolder:
    """The folder of a study's runs."""

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)

    def find(self, plan: RunPlan) -> RunRecord | None:
        """The record of a run that was done; None where it must be done."""
        path = self._path(plan)
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        known = {entry.name for entry in fields(RunRecord)}
        return RunRecord(**content) if set(content) <= known else None

    def keep(self, plan: RunPlan, record: RunRecord) -> None:
        """Write a record, in one piece or not at all.

        Raises:
            InputError: the folder cannot be written.
        """
        write_file(self._path(plan), json.dumps(asdict(record)))

    def _path(self, plan: RunPlan) -> Path:
        return self.folder / "runs" / f"{plan.key}.json"


COLUMNS = (
    *("experiment", "method", "row", "recording", "overrides", "error mm", "closest rule mm", "lost"),
    *("ms per step", "seconds", "machine", "failed"),
)


@dataclass(frozen=True)
class Done:
    """One run of the report."""

    experiment: Experiment
    method: str
    row: str
    source: Source
    record: RunRecord


def different(done: Sequence[Done]) -> Iterator[Done]:
    """Each run once: several experiments may have a row in common."""
    seen: set[str] = set()
    for one in done:
        plan = str(one.record.plan)
        if plan not in seen:
            seen.add(plan)
            yield one


def write_runs(path: Path, done: Sequence[Done]) -> Path:
    """Every row on every recording, with its overrides, as CSV."""
    lines: list[Sequence[object]] = [COLUMNS]
    for one in done:
        record = one.record
        errors = [f"{value:.2f}" for value in (record.mean_mm, record.closest_mean_mm)]
        times = [f"{value:.2f}" for value in (record.step_ms, record.seconds)]
        words = " ".join(one.experiment.overrides(one.row, method=one.method))
        named = [one.experiment.name, one.method, one.row, one.source.name, words]
        lines.append([*named, *errors, record.lost, *times, record.machine, record.failed])
    write_file(path, csv_text(lines))
    return path
