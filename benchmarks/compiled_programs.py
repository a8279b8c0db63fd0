"""Which programs does a command compile, and what does each cost?

    python benchmarks/compiled_programs.py COMMAND [key=value ...]

Runs a command of sogjax in this process, then prints a row for each name of a program: how often it was compiled, or
taken from those that are kept; seconds of tracing, lowering and compiling, and how many of these passed in other
threads than the main one; how often it was called, and seconds of its calls without those before. Seconds of tracing
count what is traced within it again; those of threads pass beside each other. Calls of equinox's programs, and of those
that are kept as they run, are known; reading one of these counts as compiling.
"""

import sys
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import equinox._jit as equinox_programs
from jax import monitoring

from sogjax.cli.main import main as sogjax
from sogjax.run.kept_programs import KeptPrograms

TRACING = "/jax/core/compile/jaxpr_trace_duration"
LOWERING = "/jax/core/compile/jaxpr_to_mlir_module_duration"
COMPILING = "/jax/core/compile/backend_compile_duration"
TABLE = "program "
"""How the table begins."""
SMALL = 0.1
"""Seconds below which all programs share a row."""


@dataclass
class Program:
    """What all programs of a name cost, in seconds."""

    traced: list[float] = field(default_factory=list)
    lowered: list[float] = field(default_factory=list)
    compiled: list[float] = field(default_factory=list)
    beside: float = 0.0
    """Part of the seconds that passed in other threads than the main one."""
    calls: list[float] = field(default_factory=list)
    """Seconds of each call, without compilation."""

    @property
    def seconds(self) -> float:
        """All seconds of tracing, lowering and compiling."""
        return sum(self.traced) + sum(self.lowered) + sum(self.compiled)

    def row(self, name: str) -> str:
        """A line of the table."""
        parts = (sum(self.traced), sum(self.lowered), sum(self.compiled), self.beside)
        seconds = "".join(f"{part:>10.2f}" for part in parts)
        return f"{name[:30]:<32}{len(self.compiled):>6}{seconds}{len(self.calls):>8}{sum(self.calls):>10.2f}"


def main() -> int:
    """Run the command and print the table."""
    programs: dict[str, Program] = defaultdict(Program)

    def note(event: str, duration_secs: float, **facts: str | int) -> None:
        program = programs[str(facts.get("fun_name", "")).removeprefix("jit(").removesuffix(")")]
        spans = {TRACING: program.traced, LOWERING: program.lowered, COMPILING: program.compiled}.get(event)
        if spans is not None:
            spans.append(duration_secs)
            program.beside += duration_secs if threading.current_thread() is not threading.main_thread() else 0.0

    equinox_programs._call = _timed(equinox_programs._call, programs)
    KeptPrograms.program = _asked(KeptPrograms.program, programs)
    monitoring.register_event_duration_secs_listener(note)
    begin, cpu = time.perf_counter(), time.process_time()
    status = sogjax(sys.argv[1:])
    print(f"{time.perf_counter() - begin:.1f} s, {time.process_time() - cpu:.1f} CPU seconds of this process")
    print_table({name: program for name, program in programs.items() if program.compiled})
    return status


def _timed(call: Callable[..., Any], programs: dict[str, Program]) -> Callable[..., Any]:
    """The function by which equinox calls its programs, noting the seconds of each that is not part of another."""
    within = threading.local()

    def timed(wrapper: Any, is_lower: bool, *arguments: Any) -> Any:
        if getattr(within, "one", False):
            return call(wrapper, is_lower, *arguments)
        program = programs[getattr(wrapper.__wrapped__, "__name__", "?")]
        begin, before, within.one = time.perf_counter(), program.seconds, True
        try:
            return call(wrapper, is_lower, *arguments)
        finally:
            within.one = False
            program.calls.append(time.perf_counter() - begin - (program.seconds - before))

    return timed


def _asked(program_of: Callable[..., Any], programs: dict[str, Program]) -> Callable[..., Any]:
    """The method that hands out kept programs, noting the seconds of reading and of running each."""

    def asked(kept: KeptPrograms, function: Any, *given: Any) -> Any:
        known, begin, held = programs[function.__name__], time.perf_counter(), kept.num_held
        before = known.seconds
        program = program_of(kept, function, *given)
        if kept.num_held > held and known.seconds == before:
            known.compiled.append(time.perf_counter() - begin)

        def timed(arrays: list[Any]) -> Any:
            begin = time.perf_counter()
            try:
                return program(arrays)
            finally:
                known.calls.append(time.perf_counter() - begin)

        return program and timed

    return asked


def print_table(programs: dict[str, Program]) -> None:
    """The slowest programs, one a row, then all others and the sum."""
    heads = f"{'times':>6}{'trace':>10}{'lower':>10}{'compile':>10}{'beside':>10}{'calls':>8}{'run':>10}"
    print(f"{TABLE:<32}{heads}")
    rows = sorted(programs.items(), key=lambda item: -item[1].seconds - sum(item[1].calls))
    small = [program for _, program in rows if program.seconds + sum(program.calls) < SMALL]
    for name, program in rows:
        if program.seconds + sum(program.calls) >= SMALL:
            print(program.row(name))
    print(_sum_of(small).row(f"{len(small)} names of less than {SMALL} s"))
    print(_sum_of(list(programs.values())).row("all"))


def _sum_of(programs: list[Program]) -> Program:
    parts = [(program.traced, program.lowered, program.compiled, program.calls) for program in programs]
    traced, lowered, compiled, calls = ([s for part in parts for s in part[k]] for k in range(4))
    return Program(traced, lowered, compiled, sum(program.beside for program in programs), calls)


if __name__ == "__main__":
    sys.exit(main())
