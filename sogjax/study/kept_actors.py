"""Actors of rendered recordings, made once and kept."""

from pathlib import Path
from tempfile import TemporaryDirectory

from sogjax.io.actor_file import load_body, save_body
from sogjax.model.body import Body
from sogjax.run.recordings import actors_of, opened
from sogjax.settings.compose import track_config


def kept_actors(folder: Path, source: Path) -> list[Body]:
    """Those that a folder holds, else made of a recording's example poses with all cameras; kept all or none.

    Raises:
        InputError: the example poses are unsuitable, or the folder cannot be written.
    """
    if not folder.is_dir():
        recording, config = opened(str(source)), track_config(recording=source)
        _keep(folder, actors_of(recording, None, config.body, config.color)[0])
    return [load_body(path) for path in sorted(folder.glob("*.yaml"))]


def _keep(folder: Path, actors: list[Body]) -> None:
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=f".{folder.name[:80]}.", suffix=".tmp", dir=folder.parent) as beside:
        whole = Path(beside) / "actors"
        for number, actor in enumerate(actors):
            save_body(whole / f"{number}_{actor.name}.yaml", actor)
        try:
            whole.rename(folder)
        except OSError:
            if not folder.is_dir():  # else another process was faster
                raise
