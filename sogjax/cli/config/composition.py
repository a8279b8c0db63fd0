"""Which endings the files of the commands may have, looked at before anything heavy is imported.

Config objects from the YAML files of `conf/` and the overrides of a command line.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from hydra import compose, initialize_config_dir
from hydra.core.config_store import ConfigStore
from hydra.core.global_hydra import GlobalHydra
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.cli.config import schemas
from sogjax.cli.config.overrides import plain_sentence, ready_for_hydra
from sogjax.errors import InputError
from sogjax.settings.compose import as_object
from sogjax.settings.files import choices_of, conf_dir, default_choices
from sogjax.settings.run import ActorConfig, AdjustConfig, TrackConfig
from sogjax.settings.wrong_values import unfit_value
from sogjax.study.settings import ReportConfig

MOTIONS = (".bvh", ".c3d", ".csv", ".glb", ".mot", ".motion", ".npz", ".trc", ".yaml", ".yml")
CALIBRATIONS = (".toml", ".calibration")
ENDINGS: dict[str, dict[str, tuple[str, ...]]] = {
    "view": {"out": (".rrd", ".png")},
}
"""By command and option; an option that is not given is not looked at."""
FORMATS = tuple(ending[1:] for ending in MOTIONS if ending not in (".motion", ".npz", ".yaml", ".yml"))
"""Of `outputs.formats`."""


def check_endings(command: str, config: Any) -> None:
    """Refuse files to write whose ending nothing can be written to, and formats that there are not.

    Raises:
        InputError: such an ending or format.
    """
    options = dict(ENDINGS.get(command, {}))
    if command == "export" and (config.calibration is None) != (config.motion is None):
        options["to"] = MOTIONS if config.calibration is None else CALIBRATIONS
    for key, endings in options.items():
        value = getattr(config, key)
        if value is not None and not Path(value).is_dir() and Path(value).suffix.lower() not in endings:
            raise InputError(f"{key}={value}: cannot be written with this ending; use {_listed(endings)}")
    for name in getattr(getattr(config, "outputs", None), "formats", None) or []:
        if name not in FORMATS:
            raise InputError(f"outputs.formats={name}: no such format; use some of {', '.join(FORMATS)}")


def _listed(endings: tuple[str, ...]) -> str:
    return f"{'one of ' if len(endings) > 1 else ''}{' '.join(endings)}"


SCHEMAS: dict[str, type] = {
    "demo": schemas.DemoConfig,
    "track": TrackConfig,
    "adjust": AdjustConfig,
    "actor": ActorConfig,
    "body": schemas.BodyConfig,
    "segment": schemas.SegmentConfig,
    "check": schemas.CheckConfig,
    "evaluate": schemas.EvaluateConfig,
    "report": ReportConfig,
    "synth": schemas.SynthConfig,
    "view": schemas.ViewConfig,
    "export": schemas.ExportConfig,
    "doctor": schemas.DoctorConfig,
}
"""The commands and their schemas."""


def config_groups(command: str) -> dict[str, list[str]]:
    """The config groups of a command and the choices of each: the YAML files of a folder of `conf/`."""
    return {group: choices_of(group) for group in default_choices(command)}


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
    words = ready_for_hydra(overrides, command, sweep=False)
    with _plain_errors(command):
        config = as_object(_tree(command, words), command)
    check_endings(command, config)
    return config


def _tree(command: str, words: Sequence[str]) -> Any:
    register_schemas()
    GlobalHydra.instance().clear()
    plain = [word for word in words if _is_no_group(command, word)]
    with initialize_config_dir(str(conf_dir()), version_base="1.3"):
        tree = compose(command, overrides=[word for word in words if word not in plain])
    for override in OverridesParser.create().parse_overrides(plain):
        key, value = override.get_key_element(), override.value()
        try:
            OmegaConf.update(tree, key, value)
        except OmegaConfBaseException as error:
            raise InputError(unfit_value(key, str(value), str(error), f"see sogjax {command} --help")) from error
    return tree


def _is_no_group(command: str, word: str) -> bool:
    """Whether a key is an option of a command that has not the config group of that name: Hydra takes it for one."""
    key = word.partition("=")[0]
    known = key in SCHEMAS[command].__dataclass_fields__ and key not in config_groups(command)
    return known and (conf_dir() / key).is_dir()


@contextmanager
def _plain_errors(command: str) -> Iterator[None]:
    """Turn Hydra's errors into one sentence each."""
    try:
        yield
    except InputError:
        raise
    except (HydraException, OmegaConfBaseException, ValueError) as error:
        raise InputError(plain_sentence(command, SCHEMAS[command], error)) from error
