"""Config objects from the YAML files of `conf/` and the overrides of a command line."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.app import configs
from sogjax.errors import InputError

SCHEMAS: dict[str, type] = {
    "demo": configs.DemoConfig,
    "track": configs.TrackConfig,
    "actor": configs.ActorConfig,
    "evaluate": configs.EvaluateConfig,
    "synth": configs.SynthConfig,
    "view": configs.ViewConfig,
    "export": configs.ExportConfig,
}
"""The commands and their schemas."""


def conf_dir() -> Path:
    """The folder of the YAML files: inside the installed package, or `conf/` of a checkout."""
    package = Path(__file__).resolve().parents[1]
    packaged = package / "conf"
    return packaged if packaged.is_dir() else package.parent / "conf"


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
    register_schemas()
    GlobalHydra.instance().clear()
    try:
        with initialize_config_dir(str(conf_dir()), version_base="1.3"):
            tree = compose(command, overrides=list(overrides))
    except (HydraException, OmegaConfBaseException) as error:
        raise InputError(_one_sentence(command, str(error))) from error
    return to_object(command, tree)


def to_object(command: str, tree: Any) -> Any:
    """The schema object of a composed config.

    Raises:
        InputError: a required key that is missing.
    """
    missing = sorted(OmegaConf.missing_keys(tree))
    if missing:
        example = f"{missing[0]}=..."
        raise InputError(f"sogjax {command} needs {', '.join(missing)}: add {example} (see sogjax {command} --help)")
    return OmegaConf.to_object(tree)


def _one_sentence(command: str, message: str) -> str:
    """Hydra's message without its hints about internals."""
    lines = [line.strip() for line in message.splitlines() if line.strip()]
    lines = [
        line for line in lines if not re.match(r"(full_key|object_type|reference_type|See http|Set the env)", line)
    ]
    text = " ".join(lines[:3])
    unknown = re.search(r"Key '([^']+)' is not in struct|Could not override '([^']+)'", text)
    if unknown:
        return f"unknown config key {unknown.group(2) or unknown.group(1)}: see sogjax {command} --help for the keys"
    return f"{text}: see sogjax {command} --help"
