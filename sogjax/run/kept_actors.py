"""Actors that a run made and that was refused later, on disk: the next run need not make them again."""

import hashlib
import shutil
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import mkdtemp

import sogjax
from sogjax.actor.make import MadeActor
from sogjax.errors import InputError
from sogjax.io.background_cache import background_folder
from sogjax.io.files import write_file
from sogjax.run.actors import ActorRequest, Actors, Report, actors_key, make_actors
from sogjax.run.terminal import say
from sogjax.settings.method import ImagesConfig

NOTE = "made_from"


def kept_or_made(request: ActorRequest, images: ImagesConfig, report: Report = lambda _: None) -> Actors:
    """The actors that an earlier run kept, made of the same pictures by the same program, or else made now and kept.

    They lie where learnt backgrounds do (`images` has the setting), until a run comes to its end. Those of
    files are not kept.

    Raises:
        InputError: as `make_actors`.
    """
    place = None if request.files is not None else _place(request, images)
    if place is not None and (found := _kept(request, images, place)) is not None:
        names = ", ".join(body.name for body in found.bodies)
        say(f"{names}: made by the run before, of the same pictures, and kept in {place}")
        return found
    new: list[MadeActor] = []

    def reported(made: Sequence[MadeActor]) -> None:
        new.extend(made)
        report(made)

    actors = make_actors(request, reported)
    if place is not None and new:
        with suppress(OSError, InputError):
            _keep(request, images, place, actors)
    return actors


def forget_actors(request: ActorRequest, images: ImagesConfig) -> None:
    """Remove what is kept: the run has ended, and its results hold the actors."""
    if (place := _place(request, images)) is not None:
        shutil.rmtree(place, ignore_errors=True)


def kept_place(request: ActorRequest, images: ImagesConfig) -> Path | None:
    """Where actors of this request are kept, if they are."""
    place = _place(request, images)
    return place if place is not None and _kept(request, images, place) is not None else None


def _kept(request: ActorRequest, images: ImagesConfig, place: Path) -> Actors | None:
    with suppress(OSError, InputError):
        if (place / NOTE).is_file() and (place / NOTE).read_text(encoding="utf-8") == _origin(request, images):
            return Actors.load(place)
    return None


def _keep(request: ActorRequest, images: ImagesConfig, place: Path, actors: Actors) -> None:
    place.parent.mkdir(parents=True, exist_ok=True)
    unfinished = Path(mkdtemp(prefix=f".{place.name[:60]}.", dir=place.parent))
    try:
        actors.save(unfinished)
        write_file(unfinished / NOTE, _origin(request, images))
        shutil.rmtree(place, ignore_errors=True)
        unfinished.rename(place)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)


def _place(request: ActorRequest, images: ImagesConfig) -> Path | None:
    """The folder of a recording's actors; None: nothing is kept."""
    try:
        folder = background_folder(images.cache)
    except InputError:
        return None
    what = hashlib.sha256(f"{request.recording.path.resolve()} {request.recording.rig.names}".encode()).hexdigest()
    return None if folder is None else folder / f"{request.recording.name}-{what[:12]}-actors"


def _origin(request: ActorRequest, images: ImagesConfig) -> str:
    """What the actors depend on: the pictures, the settings, and the program's own files."""
    code = hashlib.sha256()
    for path in sorted(Path(sogjax.__file__).parent.rglob("*")):
        if path.suffix in (".py", ".yaml"):
            status = path.stat()
            code.update(f"{path.name} {status.st_size} {status.st_mtime_ns}".encode())
    return f"{code.hexdigest()} {images.background} {actors_key(request)}"
