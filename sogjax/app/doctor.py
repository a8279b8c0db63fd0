"""`sogjax doctor`: what is installed, what it runs on, and whether it computes correctly."""

import os
import platform
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import jax

from sogjax.app.config.schemas import DoctorConfig
from sogjax.engine.compilation_cache import why_not_kept
from sogjax.engine.self_test import LAWS
from sogjax.errors import InputError

PACKAGES = (
    *("sogjax", "jax", "jaxlib", "optimistix", "equinox", "jaxtyping", "numpy", "scipy"),
    *("opencv-python-headless", "rerun-sdk", "hydra-core"),
)
CLASHING = ("opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
"""Packages that overwrite opencv-python-headless's files."""
EXTRAS = {
    "export": ("ezc3d",),
    "video": ("av",),
    "report": ("matplotlib",),
    "notebook": ("matplotlib", "ipykernel", "nbmake"),
    "joblib": ("hydra-joblib-launcher",),
    "submitit": ("hydra-submitit-launcher",),
    "ray": ("hydra-ray-launcher",),
    "optuna": ("hydra-optuna-sweeper",),
    "test": ("pytest", "pytest-xdist", "hypothesis", "beartype", "bvhio", "pygltflib"),
    "lint": ("ruff", "pyright", "import-linter"),
    "docs": ("sphinx", "myst-parser", "furo"),
}
PROBE_BYTES = 32 * 2**20
SLOW = 20.0
"""MB/s below which a folder is too slow for videos."""


def run(config: DoctorConfig) -> None:
    """Print what is installed, and test it.

    Raises:
        InputError: something that sogjax needs is missing, clashes or computes wrong results, as printed before.
    """
    troubles = [*_packages()]
    _say_machine()
    _say_cache()
    _say_extras()
    for folder in dict.fromkeys([Path(config.folder), Path(tempfile.gettempdir())]):
        troubles += _write_speed(folder)
    troubles += [trouble for name, law in LAWS.items() for trouble in _tested(name, law)]
    if troubles:
        raise InputError(f"{len(troubles)} found: {'; '.join(troubles)}")
    print("everything works")


def _line(what: str, value: str) -> None:
    print(f"{what:<28} {value}", flush=True)


def _packages() -> Iterator[str]:
    _line("python", f"{platform.python_version()} ({platform.system()} {platform.machine()})")
    for name in PACKAGES:
        found = _version(name)
        _line(name, found or "missing")
        if found is None:
            yield f"{name} is missing; install sogjax again with pip"
    for name in CLASHING:
        if _version(name) is not None:
            _line(name, f"{_version(name)}, overwrites opencv-python-headless")
            yield f"{name} is installed over opencv-python-headless; uninstall both, then install the latter"


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _say_machine() -> None:
    """The devices that jax computes on."""
    devices = jax.devices()
    _line("devices", ", ".join(f"{device.platform} {device.device_kind}" for device in devices))
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    _line("processor cores", str(cores))


def _say_cache() -> None:
    """Where compiled programs are kept, or why they are not."""
    folder = jax.config.values["jax_compilation_cache_dir"]
    if folder is None:
        _line("compiled programs", f"are not kept ({why_not_kept()})")
        return
    files = [path for path in Path(folder).glob("*-cache") if path.is_file()]
    size = sum(path.stat().st_size for path in files) / 1e6
    _line("compiled programs", f"{len(files)} in {folder} ({size:.1f} MB)")


def _say_extras() -> None:
    """Extras, which tracking alone does not need."""
    for extra, packages in EXTRAS.items():
        missing = [name for name in packages if _version(name) is None]
        remedy = f"without {', '.join(missing)}; pip install 'sogjax[{extra}]' adds it"
        _line(f"extra [{extra}]", remedy if missing else "there")


def _write_speed(folder: Path) -> Iterator[str]:
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            begin = time.monotonic()
            file.write(os.urandom(2**20) * (PROBE_BYTES // 2**20))
            file.flush()
            os.fsync(file.fileno())
            speed = PROBE_BYTES / 1e6 / (time.monotonic() - begin)
    except OSError as error:
        _line(f"writing to {folder}", f"fails ({error.strerror})")
        yield f"{folder} cannot be written ({error.strerror}); work in another folder"
        return
    _line(f"writing to {folder}", f"{speed:.0f} MB/s" + (", slow: results will wait for it" if speed < SLOW else ""))


def _tested(name: str, law: Callable[[], str | None]) -> Iterator[str]:
    """Check a law; its complaint, or an error on the way, is a problem."""
    begin = time.monotonic()
    try:
        complaint = law()
    except Exception as error:  # whatever is broken in an installation shall be said, not end the looking
        complaint = f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else 'no message'}"
    _line(f"test: {name}", f"{'right' if complaint is None else 'WRONG'} ({time.monotonic() - begin:.1f} s)")
    if complaint is not None:
        yield f"{name}: {complaint}; this machine or its libraries compute wrong results; install sogjax again"
