"""The machine and the command that figures come from."""

import datetime
import os
import platform
import sys
from pathlib import Path

import jax

from sogjax.errors import counted


def machine_line() -> str:
    """One line: processor, cores, versions, date, and the command that runs."""
    return f"{machine_facts()}, {command_line()}"


def machine_facts() -> str:
    """Processor, cores, versions and date."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return (
        f"{_processor()}, {counted(cores, 'core')}, {jax.default_backend()}, Python {platform.python_version()}, "
        f"jax {jax.__version__}, {datetime.date.today()}"
    )


def command_line() -> str:
    """The command that runs, without the folder of its program."""
    program = Path(sys.argv[0])
    folder = f"{program.parent.name}/" if program.suffix == ".py" else ""
    return " ".join([f"{folder}{program.name}", *sys.argv[1:]])


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
