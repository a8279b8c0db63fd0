"""Config objects from the YAML files of `conf/` and the overrides of a command line."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.app import configs
from sogjax.app.overrides import plain_sentence, ready_for_hydra
from sogjax.errors import InputError

SCHEMAS: dict[str, type] = {
    "demo": configs.DemoConfig,
    "track": configs.TrackConfig,
    "actor": configs.ActorConfig,
    "body": configs.BodyConfig,
    "segment": configs.SegmentConfig,
    "check": configs.CheckConfig,
    "evaluate": configs.EvaluateConfig,
    "report": configs.ReportConfig,
    "synth": configs.SynthConfig,
    "view": configs.ViewConfig,
    "export": configs.ExportConfig,
    "doctor": configs.DoctorConfig,
}
"""The commands and their schemas."""


def conf_dir() -> Path:
    """The folder of the YAML files: inside the installed package, or `conf/` of a checkout."""
    package = Path(__file__).resolve().parents[1]
    packaged = package / "conf"
    return packaged if packaged.is_dir() else package.parent / "conf"


def config_groups(command: str) -> dict[str, list[str]]:
    """The config groups of a command and the choices of each: the YAML files of a folder of `conf/`."""
    defaults = OmegaConf.to_container(OmegaConf.load(conf_dir() / f"{command}.yaml"))["defaults"]  # pyright: ignore
    groups = [next(iter(entry)).lstrip("/") for entry in defaults if isinstance(entry, dict)]
    return {group: sorted(path.stem for path in (conf_dir() / group).glob("*.yaml")) for group in groups}


def register_schemas() -> None:
    """Make the schemas known to Hydra; the YAML files build on them."""
    store = ConfigStore.instance()
    for name, schema in SCHEMAS.items():
        store.store(name=f"schema_{name}", node=schema)


def composed(command: str, overrides: Sequence[str]) -> Any:
    """The config object of a command.

    Raises:
        InputError: an unknown key, a value of the wrong type, a required key that is missing.
    """
    words = ready_for_hydra(overrides, sweep=False)
    with _plain_errors(command):
        return to_object(command, _tree(command, words))


def sweep_folder(command: str, words: Sequence[str]) -> Path:
    """Where a sweep's members go: Hydra's `hydra.sweep.dir`, as it is given or else as the command's YAML file says.

    Raises:
        InputError: a word that cannot be.
    """
    with _plain_errors(command):
        return Path(_tree(command, words, with_hydra=True).hydra.sweep.dir)


def _tree(command: str, words: Sequence[str], with_hydra: bool = False) -> Any:
    register_schemas()
    GlobalHydra.instance().clear()
    with initialize_config_dir(str(conf_dir()), version_base="1.3"):
        return compose(command, overrides=list(words), return_hydra_config=with_hydra)


@contextmanager
def _plain_errors(command: str) -> Iterator[None]:
    """Hydra's complaints as one sentence each."""
    try:
        yield
    except InputError:
        raise
    except (HydraException, OmegaConfBaseException, ValueError) as error:
        raise InputError(plain_sentence(command, SCHEMAS[command], error)) from error


def to_object(command: str, tree: Any) -> Any:
    """The schema object of a composed config.

    Raises:
        InputError: a required key that is missing, or a number that is none.
    """
    missing = sorted(configs.option_key(key) for key in OmegaConf.missing_keys(tree))
    if missing:
        examples = " ".join(f"{key}=..." for key in missing)
        raise InputError(f"{command} needs {', '.join(missing)}; add {examples} (see sogjax {command} --help)")
    config = OmegaConf.to_object(tree)
    for key, value in _numbers(config):
        if not math.isfinite(value):
            raise InputError(f"{key}={value}: must be a finite number")
    return config


def _numbers(config: Any, prefix: str = "") -> Iterator[tuple[str, float]]:
    """Every floating-point number of a config object, with its key."""
    for entry in fields(config):
        value = getattr(config, entry.name)
        if is_dataclass(value):
            yield from _numbers(value, f"{prefix}{entry.name}.")
        elif isinstance(value, float):
            yield prefix + entry.name, value
