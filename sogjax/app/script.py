"""What the scripts of `experiments/` and `benchmarks/` share: settings, tracking without files, machine and date."""

import datetime
import os
import platform
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

import jax
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.app.compilation_cache import use_compilation_cache
from sogjax.app.composition import composed
from sogjax.app.configs import TrackConfig
from sogjax.app.job import Run
from sogjax.app.overrides import quoted_value
from sogjax.app.progress import progress
from sogjax.app.recordings import actors_of, opened
from sogjax.app.track import track_recording
from sogjax.data.ground_truth import load_ground_truth
from sogjax.errors import InputError
from sogjax.evaluate import evaluate_motions
from sogjax.sentences import counted
from sogjax.synth import SynthSettings, cached_recording
from sogjax.synth.cache import default_cache_dir

Settings = TypeVar("Settings")


def settings_from(schema: type[Settings], words: Sequence[str] | None = None) -> Settings:
    """A dataclass of settings with `key=value` from the command line; leaves the program where one is wrong."""
    given = list(sys.argv[1:] if words is None else words)
    try:
        merged = OmegaConf.merge(OmegaConf.structured(schema), OmegaConf.from_dotlist(given))
        missing = sorted(OmegaConf.missing_keys(merged))
        if missing:
            raise InputError(f"add {missing[0]}=...")
        return OmegaConf.to_object(merged)  # pyright: ignore[reportReturnType]
    except (OmegaConfBaseException, InputError) as error:
        known = " ".join(f"{key}={value}" for key, value in OmegaConf.structured(schema).items())
        print(f"{str(error).splitlines()[0]}; the settings and their defaults: {known}", file=sys.stderr)
        sys.exit(2)


def demo_recording_unless_given() -> None:
    """Add the demo's recording, rendered now if it is not there yet, to a command line that names no recording."""
    if not any(word.startswith("recording=") or word in ("-h", "--help") for word in sys.argv[1:]):
        sys.argv.append(f"recording={quoted_value(str(cached_recording(SynthSettings(), progress=progress)))}")


def run_script(main: Callable[[], None]) -> None:
    """Run a script; wrong input is one sentence and exit status 2."""
    try:
        use_compilation_cache()
        main()
    except InputError as error:
        print(f"sogjax: {error}", file=sys.stderr)
        sys.exit(2)


def track_rendered(settings: SynthSettings, overrides: Sequence[str] = ()) -> Run:
    """Track a rendered recording, made now if it is not there yet, and evaluate it; no results are written.

    Its averaged pictures are kept beside it, so that further runs do not decode them again.
    """
    cache = f"images.cache={quoted_value(str(default_cache_dir() / 'cells'))}"
    return track_folder(cached_recording(settings, progress=progress), [cache, *overrides])


def track_folder(folder: Path, overrides: Sequence[str] = ()) -> Run:
    """Track a recording with overrides of the track config, and evaluate it where there is ground truth."""
    config: TrackConfig = composed("track", [f"recording={quoted_value(str(folder))}", *overrides])
    recording = opened(config.recording, config.cameras)
    bodies, _ = actors_of(recording, config.actor, config.body, config.color)
    result = track_recording(recording, bodies, config)
    if recording.ground_truth is not None:
        result.evaluation = evaluate_motions(result.motions, load_ground_truth(recording.ground_truth))
    return result


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
