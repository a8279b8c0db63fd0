"""What the scripts of `experiments/` and `benchmarks/` share: settings, wrong input, the line about the machine."""

import datetime
import platform
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import jax

from sogjax.errors import InputError, counted
from sogjax.model.cores import usable_cores
from sogjax.run.compilation_cache import use_compilation_cache, use_compiler_options
from sogjax.settings.compose import composed_config, pair_of
from sogjax.settings.option import help_lines

Settings = TypeVar("Settings")
HELP = ("--help", "-h")


def settings_from(schema: type[Settings], words: Sequence[str] | None = None) -> Settings:
    """A dataclass of settings with `key=value` from the command line; leaves the program where one is wrong."""
    given = list(sys.argv[1:] if words is None else words)
    known = " ".join(f"{key}={'...' if value == 'required' else value}" for key, value, *_ in help_lines(schema))
    if set(HELP) & set(given):
        print(f"{(sys.modules['__main__'].__doc__ or '').strip()}\n\nThe settings and their defaults: {known}")
        sys.exit(0)
    try:
        return composed_config(schema, "", map(pair_of, given))
    except InputError as error:
        print(f"{error}; the settings and their defaults: {known}", file=sys.stderr)
        sys.exit(2)


def run_script(main: Callable[[], None]) -> None:
    """Run a script; wrong input is one sentence and exit status 2."""
    try:
        use_compiler_options()
        use_compilation_cache()
        main()
    except InputError as error:
        print(f"sogjax: {error}", file=sys.stderr)
        sys.exit(2)


def machine_line() -> str:
    """One line: processor, cores, versions, date, and the command that runs."""
    return f"{machine_facts()}, {command_line()}"


def machine_facts() -> str:
    """Processor, cores, versions and date."""
    return (
        f"{_processor()}, {counted(usable_cores(), 'core')}, {jax.default_backend()}, "
        f"Python {platform.python_version()}, jax {jax.__version__}, {datetime.date.today()}"
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
