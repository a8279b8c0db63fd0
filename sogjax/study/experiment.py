"""What an experiment is: a question, rows of settings, and what the paper found. One YAML file each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml
from omegaconf import MISSING, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.errors import InputError
from sogjax.settings.compose import composed_config
from sogjax.settings.files import conf_dir
from sogjax.synth.settings import SynthSettings

MEASURES = ("accuracy", "speed")
OVERVIEW = "methods"
"""The experiment whose rows are whole methods."""
DEFAULTS = ""
"""Name of the only method where an experiment names none."""


@dataclass
class RowConfig:
    """One line of an experiment's table."""

    set: list[str] = field(default_factory=list)
    """Overrides of the track config."""
    cameras: int | None = None
    """How many of the recording's cameras look on, evenly taken; None: all."""
    synth: dict[str, Any] | None = None
    """Settings of the rendered recording that takes the place of the study's, as `sogjax synth` takes them; it is made
    when it is first needed and kept. None: the study's recordings."""
    methods: list[str] | None = None
    """Which of the experiment's methods it is run with; None: all."""
    paper: str = ""
    """What the paper says of this row, in words for the table."""
    paper_value: float | None = None
    """The paper's figure as a number for the plot, in the unit of the experiment's first column."""


@dataclass
class ExperimentConfig:
    """One question, and the settings that are compared to answer it."""

    title: str = MISSING
    question: str = MISSING
    axis: str = MISSING
    """What differs between the rows, with its unit."""
    reference: str | None = MISSING
    """The row that the others are compared with; None: rows are not compared, as where each has its own recording."""
    methods: dict[str, list[str]] = field(default_factory=dict)
    """The methods that every row is run with, by name, and their overrides; none: the defaults only."""
    base: list[str] = field(default_factory=list)
    """Overrides of all rows."""
    measure: str = "accuracy"
    """accuracy: from kept cells, one frame after the other | speed: from the videos, all stages beside each other."""
    frames: int | None = None
    """Frames of each recording that are tracked where the study does not say; None: the usual number."""
    slow: bool = False
    """Whether it is run on the fewer recordings, as those with several methods are."""
    recordings: list[str] | None = None
    """Recordings that are tracked where the study is on the recordings of the committed report; None: the study's."""
    note: str = ""
    """What holds of the comparison on any recordings."""
    iterations_by_recording: bool = False
    """Whether the iterations on each recording are shown, too."""
    degrees: bool = False
    """Whether errors of joint angles are shown by joint and plane, too."""
    paper_note: str = ""
    """What the paper's figures were measured on."""
    remark: str = ""
    """What was made of the outcome on the recordings of the committed report."""
    rows: dict[str, RowConfig] = field(default_factory=dict)


@dataclass(frozen=True)
class Experiment:
    """An experiment and its name, which is that of its file."""

    name: str
    config: ExperimentConfig

    @classmethod
    def named(cls, name: str) -> "Experiment":
        """The experiment of `conf/experiment/NAME.yaml`, or of any file whose name ends so.

        Raises:
            InputError: there is none of that name, or something in the file is wrong.
        """
        if name.endswith((".yaml", ".yml")):
            if not Path(name).is_file():
                raise InputError(f"{name}: there is no such file; give an experiment as those in conf/experiment")
            return cls.from_file(Path(name))
        path = _folder() / f"{name}.yaml"
        if not path.is_file():
            raise InputError(f"{name}: no such experiment; choose from {', '.join(experiment_names())}")
        return cls.from_file(path)

    @classmethod
    def from_file(cls, path: Path) -> "Experiment":
        """Read an experiment.

        Raises:
            InputError: something in the file is wrong.
        """
        try:
            tree = OmegaConf.merge(OmegaConf.structured(ExperimentConfig), OmegaConf.load(path))
            missing = sorted(OmegaConf.missing_keys(tree))
            if missing:
                raise InputError(f"{path}: has no {missing[0]}; add it")
            config: ExperimentConfig = OmegaConf.to_object(tree)  # pyright: ignore[reportAssignmentType]
        except (OmegaConfBaseException, yaml.YAMLError) as error:
            raise InputError(f"{path}: {str(error).splitlines()[0]}; correct it") from error
        return cls(path.stem, _checked(path, config))

    @property
    def is_shipped(self) -> bool:
        """Whether it comes with the program, so that its name alone tells it."""
        return self.name in experiment_names()

    @property
    def methods(self) -> dict[str, list[str]]:
        """The methods by name with their overrides; a single one has no name and no overrides."""
        return self.config.methods or {DEFAULTS: []}

    @property
    def compares_methods(self) -> bool:
        """Whether it shows the paper's method beside ours."""
        return bool(self.config.methods) or self.name == OVERVIEW

    @property
    def is_slow(self) -> bool:
        """Whether it is run on the fewer recordings."""
        return self.config.slow or bool(self.config.methods)

    def rows_of(self, method: str) -> list[str]:
        """The rows that are run with a method."""
        return [name for name, row in self.config.rows.items() if row.methods is None or method in row.methods]

    def overrides(self, row: str, common: Sequence[str] = (), method: str = "") -> list[str]:
        """The overrides of a row: those common to the study, then the method's, the experiment's and its own."""
        of_method = self.config.methods.get(method, [])
        return [*common, *of_method, *self.config.base, *self.config.rows[row].set]


def synth_settings(chosen: Mapping[str, Any]) -> SynthSettings:
    """The settings of a rendered recording, of which some are chosen.

    Raises:
        InputError: an unknown setting (with the nearest known one), or a value of the wrong type.
    """
    return composed_config(SynthSettings, "synth", chosen.items())


def experiment_names() -> list[str]:
    """The experiments that come with the program, in the order of a report."""
    present = {path.stem for path in _folder().glob("*.yaml")}
    return [name for name in _ORDER if name in present] + sorted(present - set(_ORDER))


_ORDER = (
    "methods",
    "limit_weight",
    "acceleration_weight",
    "occlusion_cap",
    "ascent",
    "resolution",
    "cameras",
    "solvers",
    "frame_rate",
    "epsilon",
    "min_iterations",
    "color_space",
    "color_radius",
    "color_tolerance",
    "depth",
    "extrapolation",
    "overlap_exponent",
    "throughput",
    "sequences",
    "together",
)
"""The paper's own experiments first."""


def _folder() -> Path:
    return conf_dir() / "experiment"


def _checked(path: Path, config: ExperimentConfig) -> ExperimentConfig:
    if config.reference is not None and config.reference not in config.rows:
        raise InputError(f"{path}: reference: {config.reference!r} is not a row; choose from {', '.join(config.rows)}")
    if config.measure not in MEASURES:
        raise InputError(f"{path}: measure: {config.measure!r}: use one of {', '.join(MEASURES)}")
    for name, row in config.rows.items():
        if unknown := sorted(set(row.methods or ()) - set(config.methods)):
            raise InputError(f"{path}: row {name!r}: methods: {unknown[0]!r} is none of {', '.join(config.methods)}")
        if row.cameras is not None and row.cameras < 1:
            raise InputError(f"{path}: row {name!r}: cameras={row.cameras}: must be 1 or more")
        try:
            synth_settings(row.synth or {}).check()
        except InputError as error:
            raise InputError(f"{path}: row {name!r}: {error}") from error
    return config


def yardsticks(names: Sequence[str] = ()) -> dict[str, dict[str, object]]:
    """The settings of rendered recordings, by the names of their rows.

    Args:
        names: rows of the experiments `sequences` and `together`; none: all of `sequences`.

    Raises:
        InputError: a name that is no row's.
    """
    whole = _rendered("sequences")
    known = {**whole, **_rendered("together")} if names else whole
    unknown = [name for name in names if name not in known]
    if unknown:
        raise InputError(f"sequences: {unknown[0]}: is none of {', '.join(known)}")
    return {name: known[name] for name in names or whole}


def _rendered(name: str) -> dict[str, dict[str, object]]:
    """The settings of the recordings of an experiment's rows that are run with all its methods."""
    rows = Experiment.named(name).config.rows
    return {name: row.synth for name, row in rows.items() if row.synth is not None and row.methods is None}
