"""What only a process of its own shows: how long importing takes, and the most memory that is resident.

python benchmarks/processes.py first_frame|memory ACTOR_FILE
"""

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from quantities import Quantity

IMPORT = "import time; begin = time.perf_counter(); import sogjax; print(time.perf_counter() - begin)"
"""A program of its own, in which nothing is imported yet."""


def process_quantities(actor: Path) -> Iterator[Quantity]:
    """Start-up and memory, each from a process that does nothing else; no compiled programs are kept."""
    yield Quantity("start-up", "import sogjax", measured("import", actor), "s", target=1.0)
    yield Quantity("start-up", "first tracked frame, cold", measured("first_frame", actor), "s", target=15.0)
    yield Quantity("memory", "most resident, demo, all outputs", measured("memory", actor), "MiB", target=1536.0)


def measured(what: str, actor: Path) -> float:
    """The number that a process of its own prints."""
    environment = os.environ | {"SOGJAX_COMPILATION_CACHE": "off"}
    command = [sys.executable, __file__, what, str(actor)]
    if what == "import":
        command = [sys.executable, "-c", IMPORT]
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, env=environment)
    return float(json.loads(done.stdout.splitlines()[-1]))


def first_frame_seconds(actor: str) -> float:
    """From the start of the imports to the initial pose, the actor being known."""
    begin = time.perf_counter()
    from track_speed import demo_recording

    from sogjax.study.tracked import track_folder

    track_folder(demo_recording(), [f"actor={actor}", "stop=1"])
    return time.perf_counter() - begin


def resident_mib(actor: str) -> float:
    """After tracking the demo with all outputs; Linux only."""
    from memory import most_resident_mib
    from track_speed import demo_recording

    from sogjax.run.track import track_to_folder
    from sogjax.settings.compose import track_config

    with TemporaryDirectory() as folder:
        track_to_folder(track_config(recording=demo_recording(), actor=actor, out=f"{folder}/demo"))
    return most_resident_mib()


if __name__ == "__main__":
    kind, actor_file = sys.argv[1:]
    numbers = {"first_frame": first_frame_seconds, "memory": resident_mib}
    print(json.dumps(numbers[kind](actor_file)))
