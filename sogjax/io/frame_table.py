"""The table of a run: what was found in every frame, a row each.

Its columns are listed here and nowhere else: the log on disk, resuming, motions, and what is shown of a run all follow
from them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Bool, Float, Int

from sogjax.errors import InputError
from sogjax.io.array_log import ArrayLog, read_log
from sogjax.io.npz_file import read_npz, save_npz

TERM = "term_"
"""The beginning of the names of columns that hold terms of the energy, in files."""


def column(unit: str, meaning: str, **default: Any) -> Any:
    """A column of the table: its name and shape are those of the field."""
    return field(metadata={"unit": unit, "meaning": meaning}, **default)


@dataclass(frozen=True)
class FrameTable:
    """What was found in the frames of a clip, all actors as one model; optional columns are None where unknown."""

    frame: Int[np.ndarray, "frame"] = column("", "the recording's number of the frame, increasing")
    pose: Float[np.ndarray, "frame dof"] = column(
        "rad, m",
        "Theta of all actors; angles go on beyond half a turn, but may jump by whole ones at the ends of a merged "
        "stretch: unwrap before filtering",
    )
    energy: Float[np.ndarray, "frame"] = column("", "Eq. 10")
    iterations: Int[np.ndarray, "frame"] = column("", "iterations of the solver")
    evaluations: Int[np.ndarray, "frame"] = column("", "evaluations of the energy with its gradient")
    converged: Bool[np.ndarray, "frame"] = column("", "whether the solver did")
    num_near: Int[np.ndarray, "frame camera"] = column("", "image blobs near the actors")
    num_matching: Int[np.ndarray, "frame camera"] = column("", "those of them in the actors' colours")
    num_blocks: Int[np.ndarray, "frame"] = column("", "blocks of near pairs; 0 where all pairs were compared")
    capacities: Int[np.ndarray, "frame 3"] = column("", "room for near and matching image blobs, and for blocks")
    limb_doubt: Float[np.ndarray, "frame limb"] | None = column(
        "", "probability that the limb is more than 10 cm off", default=None
    )
    baseline: Float[np.ndarray, "frame 2 blob"] | None = column(
        "", "what was usually seen in the blobs' places so far (`LimbConfidence.baseline`)", default=None
    )
    explained: Float[np.ndarray, "frame actor"] | None = column(
        "", "part of the actor's visible area that shows its own colours and no background", default=None
    )
    overlap: Float[np.ndarray, "frame actor camera"] | None = column(
        "", "silhouette and foreground, intersection over union; NaN where no background is known", default=None
    )
    unfiltered_pose: Float[np.ndarray, "frame dof"] | None = column(
        "rad, m", "Theta before it was filtered; only where it was", default=None
    )
    limb_hidden: Float[np.ndarray, "frame limb"] | None = column(
        "", "part of the limb that things in front hide from the cameras", default=None
    )
    limb_rival: Float[np.ndarray, "frame limb"] | None = column(
        "",
        "part of an actor's energy that the best other way to hold the limb gains (losses beyond 0.5 % are cut off); "
        "interpolated between key frames, NaN where none was searched",
        default=None,
    )
    limb_unlike: Float[np.ndarray, "frame limb"] | None = column(
        "", "limb_doubt by what is seen of the limb alone; only where it weighs rivals, too", default=None
    )
    terms: Mapping[str, Float[np.ndarray, "frame"]] = column(
        "", "each term of the energy without its weight, by name", default_factory=dict
    )

    def __len__(self) -> int:
        return len(self.frame)

    def __getitem__(self, rows: slice | np.ndarray) -> "FrameTable":
        """Some of the rows."""
        return FrameTable.from_arrays({name: values[rows] for name, values in self.arrays().items()})

    @property
    def is_judged(self) -> bool:
        """Whether the limbs were judged."""
        return self.limb_doubt is not None

    @property
    def seen_doubt(self) -> Float[np.ndarray, "frame limb"] | None:
        """What `limb_doubt` is by what is seen of limbs alone."""
        return self.limb_doubt if self.limb_unlike is None else self.limb_unlike

    def arrays(self) -> dict[str, np.ndarray]:
        """The columns that are there, by their names in files."""
        found = {each.name: getattr(self, each.name) for each in _plain_columns()}
        known = {name: values for name, values in found.items() if values is not None}
        return known | {TERM + name: np.asarray(values) for name, values in self.terms.items()}

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> "FrameTable":
        """The table of columns as `arrays` names them.

        Raises:
            InputError: a column that every table has is missing.
        """
        names = {each.name for each in _plain_columns()}
        missing = [each.name for each in _plain_columns() if each.default is not None and each.name not in arrays]
        if missing:
            raise InputError(f"the table of frames has no column {missing[0]!r}; track again")
        terms = {name.removeprefix(TERM): values for name, values in arrays.items() if name.startswith(TERM)}
        return cls(**{name: values for name, values in arrays.items() if name in names}, terms=terms)

    @classmethod
    def joined(cls, parts: Sequence["FrameTable"]) -> "FrameTable":
        """The rows of several tables, one after the other."""
        arrays = [part.arrays() for part in parts]
        return cls.from_arrays({name: np.concatenate([each[name] for each in arrays]) for name in arrays[0]})

    def with_rows(self, rows: Iterable[int], values: Sequence[Mapping[str, Any]]) -> "FrameTable":
        """The table with other values in some rows, by the columns' names in files."""
        arrays = {name: np.array(column) for name, column in self.arrays().items()}
        for row, changed in zip(rows, values, strict=True):
            for name, value in changed.items():
                arrays[name][row] = value
        return FrameTable.from_arrays(arrays)


def _plain_columns() -> list[Field]:
    return [each for each in fields(FrameTable) if each.name != "terms"]


@dataclass(frozen=True)
class FramesRecord:
    """What a pass leaves that finds frames, or finds other ones: their table, kept in a run's folder."""

    table: FrameTable
    file: ClassVar[str] = "frames.npz"
    """Its name in the folder."""

    def save(self, folder: Path) -> None:
        """Keep it in a run's folder."""
        save_npz(folder / self.file, self.table.arrays())

    @classmethod
    def load(cls, folder: Path) -> "FramesRecord | None":
        """What was kept, if it was."""
        path = folder / cls.file
        return cls(FrameTable.from_arrays(read_npz(path))) if path.is_file() else None


class FrameLog:
    """A table that grows on disk, a block of rows at a time; it can be read at any moment, after a crash too.

    Args:
        folder: of the log; it is made with the first rows.
        kept: rows of an existing log after which this one goes on; those behind them are dropped.

    Raises:
        InputError: the folder cannot be written, here or later.
    """

    def __init__(self, folder: Path, kept: int = 0):
        self.folder, self._kept = folder, kept
        self._log: ArrayLog | None = None

    def append(self, rows: FrameTable) -> None:
        """Write the rows that follow."""
        if self._log is None:
            self._log = ArrayLog(self.folder, {}, rows.arrays(), self._kept)
        else:
            self._log.append(rows.arrays())

    def __enter__(self) -> "FrameLog":
        return self

    def __exit__(self, *error: object) -> None:
        """Close the file; what was written stays."""
        if self._log is not None:
            self._log.close()


def read_frames_log(folder: Path) -> FrameTable | None:
    """The rows that a `FrameLog` wrote; None where there is none, or one of another version of the program."""
    try:
        table = FrameTable.from_arrays(read_log(folder))
    except (InputError, TypeError):
        return None
    shapes_fit = table.baseline is None or (table.baseline.ndim == 3 and table.explained is not None)
    return table if shapes_fit and len({len(values) for values in table.arrays().values()}) == 1 else None
