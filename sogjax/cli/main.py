"""The console script `sogjax`: a subcommand for each task, with `key=value` as arguments.

SIGTERM, as sent by batch systems and `kill`, ends a command as tidily as Ctrl-C.
"""

import gc
import os
import pkgutil
import signal
import sys
import textwrap
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from types import FrameType

INTERRUPTED, TERMINATED = 130, 143
"""Exit status after Ctrl-C and SIGTERM, as in shells."""
HELP = ("-h", "--help")
USAGE = "usage: sogjax COMMAND [key=value ...] [-m for a sweep], sogjax COMMAND --help"
FUNCTIONS = {"adjust": "track:adjust", "body": "export:body", "demo": "synth:demo"}
"""Modules and functions of the commands that are not the `run` of a module of their own."""


RARELY = 100
"""How many younger collections of garbage pass before one looks at everything: tracing leaves millions of objects that
stay, and a look at them takes a quarter of a second in which no thread goes on."""


def run_process() -> int:
    """Run the command of this process, which ends soon after; what it returns is the exit status."""
    gc.set_threshold(*gc.get_threshold()[:2], RARELY)
    try:
        return main()
    finally:
        gc.freeze()  # else the interpreter takes a second to look for garbage before it ends


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command; 0: done, 2: the input was wrong (one sentence on standard error)."""
    begin, is_process = time.perf_counter(), arguments is None
    arguments = list(sys.argv[1:] if arguments is None else arguments)
    from sogjax.cli.schemas import SCHEMAS
    from sogjax.cli.words import composed
    from sogjax.errors import InputError
    from sogjax.run.clock import STARTING, age_of_process, clocked, stage
    from sogjax.run.compilation_cache import use_compilation_cache, use_compiler_options
    from sogjax.run.compile_once import compile_once

    if not arguments or arguments[0] in (*HELP, "help"):
        print(_overview())
        return 0 if arguments else 2
    if arguments[0] == "--version":
        print(version("sogjax"))
        return 0
    command, words = arguments[0], arguments[1:]
    if command not in SCHEMAS:
        return _wrong_input(f"no command {command!r}; use one of {', '.join(SCHEMAS)} ({USAGE})")
    if any(word.partition("=")[0] in HELP for word in words):
        print(command_help(command, everything=any(word.rpartition("=")[2] == "all" for word in words)))
        return 0
    try:
        use_compiler_options()
        use_compilation_cache()
        if any(word in ("-m", "--multirun") for word in words):
            from sogjax.cli.sweep.run import run_sweep

            return run_sweep(command, [word for word in words if word not in ("-m", "--multirun")])
        config = composed(command, words)
        begun = max(time.perf_counter() - begin, age_of_process() if is_process else 0.0)
        with terminated_as_interrupted(), clocked(begun):
            with stage(STARTING):
                run = pkgutil.resolve_name(f"sogjax.cli.{FUNCTIONS.get(command, f'{command}:run')}")
                compile_once()
                pkgutil.resolve_name("sogjax.run.kept_programs:hold_programs")()
            run(config)
    except InputError as error:
        return _wrong_input(str(error))
    except KeyboardInterrupt as stop:
        print("\nstopped", file=sys.stderr)
        return TERMINATED if isinstance(stop, TerminatedError) else INTERRUPTED
    return 0


def command_help(command: str, everything: bool = False) -> str:
    """The options of a command with default, unit and the paper's symbol; those for experts only with `everything`."""
    from sogjax.cli.schemas import SCHEMAS
    from sogjax.errors import counted
    from sogjax.settings.files import choices_of, default_choices
    from sogjax.settings.option import help_lines

    schema = SCHEMAS[command]
    lines = [f"sogjax {command} [key=value ...]", "", (schema.__doc__ or "").strip(), ""]
    options = help_lines(schema)
    shown = [option for option in options if everything or not option.expert]
    for option in shown:
        lines += textwrap.wrap(f"{option.key}={option.default}", 118, initial_indent="  ")
        lines += textwrap.wrap(option.text, 110, initial_indent="        ", subsequent_indent="        ")
    groups = {group: choices_of(group) for group in default_choices(command)}
    if groups:
        lines += ["", "sets of options by name, such as " + f"{next(iter(groups))}={next(iter(groups.values()))[0]}:"]
        lines += [f"  {group}={' | '.join(names)}" for group, names in groups.items()]
    if hidden := len(options) - len(shown):
        lines += ["", f"sogjax {command} --help all lists {counted(hidden, 'more setting')}"]
    return "\n".join(lines)


def _overview() -> str:
    from sogjax.cli.schemas import SCHEMAS

    rows = [f"  {name:<10} {(schema.__doc__ or '').strip()}" for name, schema in SCHEMAS.items()]
    return "\n".join(["Markerless motion capture by Sums of Gaussians.", "", USAGE, "", *rows])


def _wrong_input(sentence: str) -> int:
    print(f"sogjax: {sentence}", file=sys.stderr)
    return 2


class TerminatedError(KeyboardInterrupt):
    """Somebody asked the program to end."""


@contextmanager
def terminated_as_interrupted() -> Iterator[None]:
    """Within the block SIGTERM raises a `TerminatedError`, so that results are written and the rest is removed.

    Does nothing outside the main thread, which alone receives signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _terminate(number: int, frame: FrameType | None) -> None:
    """Raise; where the signal came in a function whose errors the interpreter ignores, send it again in 0.05 s."""
    if frame is not None and frame.f_code.co_name in ("_xla_gc_callback", "__del__"):
        threading.Timer(0.05, os.kill, (os.getpid(), number)).start()
        return
    raise TerminatedError
