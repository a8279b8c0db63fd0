"""Films a stage with all its cameras, shared out to several processes."""

import json
import os
import queue
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from sogjax.errors import InputError
from sogjax.synth.filming import film
from sogjax.synth.settings import SynthSettings
from sogjax.synth.stage import Stage

_PACKAGE_ROOT = Path(__file__).resolve().parents[2]
_WORTH_A_PROCESS = 60
"""Pictures; fewer are made sooner than another process has started."""


def num_workers(pictures: int, cameras: int) -> int:
    """How many processes to use for so many pictures."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min(cores, cameras, pictures // _WORTH_A_PROCESS))


def film_all(stage: Stage, folder: Path, workers: int) -> Iterator[None]:
    """Film with every camera; yields after each picture. With one worker, in this process."""
    cameras = range(len(stage.views))
    if workers == 1:
        yield from film(stage, cameras, folder)
        return
    done: queue.Queue[str] = queue.Queue()
    processes = [_started(stage.settings, list(cameras[k::workers]), folder, done) for k in range(workers)]
    try:
        yield from _pictures(processes, done)
    finally:
        for process in processes:
            process.kill()
            process.wait()


def _started(
    settings: SynthSettings, cameras: Sequence[int], folder: Path, done: "queue.Queue[str]"
) -> "subprocess.Popen[str]":
    """A process that films with some cameras; a thread passes on what it tells, then `end`."""
    environment = dict(os.environ)
    paths = [str(_PACKAGE_ROOT), environment.get("PYTHONPATH", "")]
    environment["PYTHONPATH"] = os.pathsep.join(path for path in paths if path)
    # One thread each: the processes are as many as the cores.
    environment |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "JAX_PLATFORMS": "cpu"}
    log = (folder / f".worker_{cameras[0]}.log").open("w+", encoding="utf-8")
    process = subprocess.Popen(
        [sys.executable, "-m", "sogjax.synth.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=log,
        text=True,
        env=environment,
    )
    assert process.stdin is not None
    json.dump({"settings": asdict(settings), "cameras": list(cameras), "folder": str(folder)}, process.stdin)
    process.stdin.close()

    def listen() -> None:
        assert process.stdout is not None
        for line in process.stdout:
            done.put(line.strip())
        process.stdout.close()
        code = process.wait()
        log.seek(0)
        done.put("end" if code == 0 else f"failed: {log.read()[-2000:]}")
        log.close()

    threading.Thread(target=listen, daemon=True).start()
    return process


def _pictures(processes: Sequence["subprocess.Popen[str]"], done: "queue.Queue[str]") -> Iterator[None]:
    ended = 0
    while ended < len(processes):
        message = done.get()
        if message == "picture":
            yield
        elif message == "end":
            ended += 1
        elif message.startswith("refused "):
            raise InputError(message.removeprefix("refused "))
        elif message.startswith("failed"):
            raise RuntimeError(f"a rendering process {message}")
