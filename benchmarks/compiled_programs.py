"""Which programs does a command compile, and what does each cost?

    python benchmarks/compiled_programs.py COMMAND [key=value ...]

Runs a command of sogjax in this process, then prints a row for each name of a program: how often it was traced and
compiled, or taken from those that are kept, in how many seconds, and how many of these passed in other threads than the
main one. Seconds of tracing count what is traced within it again; those of threads pass beside each other.
"""

import sys
import threading
import time
from collections import defaultdict
from dataclasses import dataclass, field

import jax
from jax import monitoring

from sogjax.cli.main import main as sogjax

TRACING = "/jax/core/compile/jaxpr_trace_duration"
LOWERING = "/jax/core/compile/jaxpr_to_mlir_module_duration"
COMPILING = "/jax/core/compile/backend_compile_duration"
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

    @property
    def seconds(self) -> float:
        """All seconds of tracing, lowering and compiling."""
        return sum(self.traced) + sum(self.lowered) + sum(self.compiled)

    def row(self, name: str) -> str:
        """A line of the table."""
        parts = (sum(self.traced), sum(self.lowered), sum(self.compiled), self.beside)
        return f"{name[:48]:<50}{len(self.compiled):>6}" + "".join(f"{part:>10.2f}" for part in parts)


def main() -> int:
    """Run the command and print the table."""
    programs: dict[str, Program] = defaultdict(Program)

    def note(event: str, seconds: float, fun_name: str = "", **_: object) -> None:
        program = programs[fun_name.removeprefix("jit(").removesuffix(")")]
        spans = {TRACING: program.traced, LOWERING: program.lowered, COMPILING: program.compiled}.get(event)
        if spans is not None:
            spans.append(seconds)
            program.beside += seconds if threading.current_thread() is not threading.main_thread() else 0.0

    monitoring.register_event_duration_secs_listener(note)
    begin, cpu = time.perf_counter(), time.process_time()
    status = sogjax(sys.argv[1:])
    print(f"{time.perf_counter() - begin:.1f} s, {time.process_time() - cpu:.1f} CPU seconds of this process")
    print_table({name: program for name, program in programs.items() if program.compiled})
    return status


def print_table(programs: dict[str, Program]) -> None:
    """The slowest programs, one a row, then all others and the sum."""
    print(f"{'program':<50}{'times':>6}{'trace':>10}{'lower':>10}{'compile':>10}{'beside':>10}")
    rows = sorted(programs.items(), key=lambda item: -item[1].seconds)
    small = [program for _, program in rows if program.seconds < SMALL]
    for name, program in rows:
        if program.seconds >= SMALL:
            print(program.row(name))
    print(_sum_of(small).row(f"{len(small)} names of less than {SMALL} s"))
    print(_sum_of(list(programs.values())).row("all"))


def _sum_of(programs: list[Program]) -> Program:
    parts = [(program.traced, program.lowered, program.compiled) for program in programs]
    traced, lowered, compiled = ([s for part in parts for s in part[k]] for k in range(3))
    return Program(traced, lowered, compiled, sum(program.beside for program in programs))


if __name__ == "__main__":
    sys.exit(main())
