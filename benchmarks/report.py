"""How fast, how large and how exact is everything, in one table; and is anything worse than it was?

python benchmarks/report.py [--json FILE] [--compare FILE] [--frames 40] [--only energy,growth,...]

Takes a few minutes. `--compare benchmarks/baseline.json` names what is worse than in an earlier report by more than its
kind of quantity allows (`quantities.ALLOWED`, `ADDED`) and then ends with exit status 1. Times are compared in units of
a reference workload that both reports measured, so that reports of different machines can be compared. On a machine
with a GPU that jax uses, everything is measured there.
"""

import argparse
import json
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from decoding import decoding_quantities
from energies import energy_quantities, growth_quantities
from memory import long_quantities
from processes import process_quantities
from quantities import Quantity, is_worse, reference_milliseconds
from runs import Scene, end_to_end_quantities, solver_quantities, stage_quantities
from start_up import start_up_quantities
from sweep_speed import sweep_quantities

from sogjax.io.actor_file import save_body
from sogjax.io.files import write_file
from sogjax.run.compilation_cache import use_compiler_options
from sogjax.study.script import machine_line

REFERENCE = "reference ms"
FORMAT = 1


def main() -> int:
    """Measure, print, write and compare; the exit status."""
    use_compiler_options()
    arguments = parsed()
    sections = arguments.only.split(",") if arguments.only else list(parts())
    if unknown := [section for section in sections if section not in parts()]:
        print(f"--only {unknown[0]}: no such part; choose from {', '.join(parts())}", file=sys.stderr)
        return 2
    if arguments.compare and not Path(arguments.compare).is_file():
        print(f"--compare {arguments.compare}: no such file; make one with --json", file=sys.stderr)
        return 2
    references = [reference_milliseconds()]
    scene = Scene.demo(arguments.frames)
    print(machine_line(), end="\n\n", flush=True)
    quantities = []
    for section in sections:
        for quantity in parts()[section](scene):
            quantities.append(quantity)
            print(row(quantity), flush=True)
        references.append(reference_milliseconds())
    reference = min(references)
    print(f"\nreference workload {reference:.2f} ms")
    if arguments.json:
        write(Path(arguments.json), quantities, reference)
    return compare(Path(arguments.compare), quantities, reference) if arguments.compare else 0


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--json", help="file to write")
    parser.add_argument("--compare", help="file that an earlier report wrote")
    parser.add_argument("--frames", type=int, default=40, help="of the demo that are tracked")
    parser.add_argument("--only", help=f"parts, separated by commas: {','.join(parts())}")
    return parser.parse_args()


def parts() -> dict[str, Callable[[Scene], Iterable[Quantity]]]:
    """What is measured, in order."""
    return {
        "energy": lambda _: energy_quantities(),
        "solver": solver_quantities,
        "stage": stage_quantities,
        "decoding": lambda scene: decoding_quantities(scene.recording, scene.frames),
        "end_to_end": end_to_end_quantities,
        "growth": lambda _: growth_quantities(),
        "process": with_actor(lambda _, actor: process_quantities(actor)),
        "start_up": with_actor(lambda _, actor: start_up_quantities(actor)),
        "sweep": with_actor(lambda scene, actor: sweep_quantities(actor, scene.frames)),
        "long": with_actor(lambda scene, actor: long_quantities(scene.folder, actor)),
    }


def with_actor(
    measure: Callable[[Scene, Path], Iterable[Quantity]],
) -> Callable[[Scene], Iterator[Quantity]]:
    """A measurement that is given the scene's actor as a file."""

    def measured(scene: Scene) -> Iterator[Quantity]:
        with TemporaryDirectory() as folder:
            actor = Path(folder) / "actor.yaml"
            save_body(actor, scene.bodies[0])
            yield from measure(scene, actor)

    return measured


def row(quantity: Quantity) -> str:
    """One line of the table."""
    sign = "" if quantity.target is None else ">=" if quantity.larger_is_better else "<="
    target = "" if quantity.target is None else f"{sign} {quantity.target:g}"
    verdict = {None: "", True: "met", False: "MISSED"}[quantity.met]
    unit = "" if quantity.kind in ("ratio", "exponent", "count", "energy") else quantity.kind
    return (
        f"{quantity.section:<12}{quantity.name:<52}{quantity.value:>12.4g} {unit:<10}{target:>10}  {verdict}".rstrip()
    )


def write(path: Path, quantities: list[Quantity], reference: float) -> None:
    """The report as JSON: the machine, the time of the reference workload, and every number with its unit."""
    content = {
        "format": FORMAT,
        "machine": machine_line(),
        REFERENCE: reference,
        "quantities": {q.key: {"value": q.value, "unit": q.kind, "target": q.target} for q in quantities},
    }
    write_file(path, json.dumps(content, indent=1) + "\n")


def compare(path: Path, quantities: list[Quantity], reference: float) -> int:
    """Name what is worse than in an earlier report; 1 where anything is."""
    content = json.loads(path.read_text(encoding="utf-8"))
    before = {key: entry["value"] for key, entry in content["quantities"].items()}
    then = content[REFERENCE]
    known = [q for q in quantities if q.key in before]
    worse = [q for q in known if is_worse(q, before[q.key], reference, then)]
    print(f"\nagainst {path}: {len(known)} quantities compared, {len(worse)} worse than allowed")
    print(f"(this machine takes {reference / then:.2f} of that one's time for the reference workload)")
    for q in worse:
        print(f"  {q.key}: {q.value:.4g} {q.kind}, was {before[q.key]:.4g}")
    return 1 if worse else 0


if __name__ == "__main__":
    sys.exit(main())
