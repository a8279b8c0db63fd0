"""What the scripts of `experiments/` and `benchmarks/` share: settings from the command line, and wrong input."""

import sys
from collections.abc import Callable, Sequence
from typing import TypeVar

from omegaconf import MISSING, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from sogjax.errors import InputError
from sogjax.run.compilation_cache import use_compilation_cache, use_compiler_options

Settings = TypeVar("Settings")
HELP = ("--help", "-h")


def settings_from(schema: type[Settings], words: Sequence[str] | None = None) -> Settings:
    """A dataclass of settings with `key=value` from the command line; leaves the program where one is wrong."""
    given = list(sys.argv[1:] if words is None else words)
    defaults = OmegaConf.to_container(OmegaConf.structured(schema), throw_on_missing=False)
    assert isinstance(defaults, dict)
    known = " ".join(f"{key}={'...' if value == MISSING else value}" for key, value in defaults.items())
    if set(HELP) & set(given):
        print(f"{(sys.modules['__main__'].__doc__ or '').strip()}\n\nThe settings and their defaults: {known}")
        sys.exit(0)
    try:
        merged = OmegaConf.merge(OmegaConf.structured(schema), OmegaConf.from_dotlist(given))
        missing = sorted(OmegaConf.missing_keys(merged))
        if missing:
            raise InputError(f"add {missing[0]}=...")
        return OmegaConf.to_object(merged)  # pyright: ignore[reportReturnType]
    except (OmegaConfBaseException, InputError) as error:
        print(f"{str(error).splitlines()[0]}; the settings and their defaults: {known}", file=sys.stderr)
        sys.exit(2)


def run_script(main: Callable[[], None]) -> None:
    """Run a script; wrong input is one sentence and exit status 2."""
    try:
        use_compiler_options()
        use_compilation_cache()
        main()
    except InputError as error:
        print(f"sogjax: {error}", file=sys.stderr)
        sys.exit(2)
