"""Camera calibrations: one reader per format, chosen by the content of the file."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sogjax.errors import InputError
from sogjax.io.calibration.easymocap import other_half, read_easymocap, recognises_easymocap
from sogjax.io.calibration.qualisys import read_qualisys, recognises_qualisys
from sogjax.io.calibration.rig import METRES_PER_UNIT, CameraRig
from sogjax.io.calibration.skeletool import read_skeletool, recognises_skeletool, write_skeletool
from sogjax.io.calibration.tables import read_panoptic, read_toml, recognises_panoptic, recognises_toml, write_toml
from sogjax.io.files import visible_files


@dataclass(frozen=True)
class CalibrationFormat:
    """A calibration format: how to tell it by its text, and how to read it."""

    name: str
    unit: str
    """The unit of length that the format prescribes: m, cm or mm."""
    recognises: Callable[[str], bool]
    """Tells the format by the first 64 KiB of a file's text."""
    read: Callable[[Path, str], CameraRig]
    """Reads a file whose lengths are in the given unit."""


FORMATS: tuple[CalibrationFormat, ...] = (
    CalibrationFormat("Anipose/Pose2Sim/FreeMoCap TOML", "m", recognises_toml, read_toml),
    CalibrationFormat("OpenCV/EasyMocap YAML", "m", recognises_easymocap, read_easymocap),
    CalibrationFormat("Skeletool .calibration", "mm", recognises_skeletool, read_skeletool),
    CalibrationFormat("Qualisys .qca.txt", "mm", recognises_qualisys, read_qualisys),
    CalibrationFormat("Panoptic JSON", "cm", recognises_panoptic, read_panoptic),
)

WRITERS: dict[str, Callable[[Path, CameraRig], None]] = {".toml": write_toml, ".calibration": write_skeletool}
"""What writes a calibration, by the file's ending."""


def load_calibration(path: Path, unit: str | None = None) -> CameraRig:
    """The cameras of a calibration file of any known format; lengths become metres.

    `unit` (`m` or `mm`) says what the file's lengths are, where it is not what the format prescribes.

    Raises:
        InputError: no such file, unknown format or unit, or something wrong inside.
    """
    if unit is not None and unit not in METRES_PER_UNIT:
        raise InputError(f"{path}: unknown unit {unit!r} for its lengths; use {' or '.join(METRES_PER_UNIT)}")
    if not path.is_file():
        raise InputError(f"{path}: there is no such calibration file; correct the name or calibrate the cameras")
    found = _format(path)
    if found is None:
        known = ", ".join(known.name for known in FORMATS)
        raise InputError(f"{path}: is not a calibration of a known format; export it as one of: {known}")
    return found.read(path, unit or found.unit)


def save_calibration(path: Path, rig: CameraRig) -> None:
    """Write the cameras in the format that the ending of `path` names.

    Raises:
        InputError: an ending that no writer knows, or what the format cannot hold.
    """
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        raise InputError(f"{path}: no calibration is written with this extension; use one of: {' '.join(WRITERS)}")
    writer(path, rig)


def find_calibrations(folder: Path) -> list[Path]:
    """The files in `folder` that some reader recognises or that are called `calibration.*`, sorted.

    Of a pair `intri.yml` and `extri.yml` only one is among them.
    """
    kept: list[Path] = []
    for path in visible_files(folder):
        known = _format(path) if path.is_file() else None
        named = path.is_file() and path.stem == "calibration"
        twice = known is not None and known.read is read_easymocap and other_half(path) in kept
        if (named or known is not None) and not twice:
            kept.append(path)
    return kept


def _format(path: Path) -> CalibrationFormat | None:
    """The format of a file by its content, or None; a file that cannot be read has none."""
    try:
        with path.open("rb") as file:
            text = file.read(64 * 2**10).decode("utf-8-sig", errors="replace")
    except OSError:
        return None
    if "\0" in text:
        return None
    return next((known for known in FORMATS if known.recognises(text)), None)
