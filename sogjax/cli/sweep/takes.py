"""Many recordings by one command: each as if tracked alone, one table at the end, and only what is missing is done.

Each subject has one actor, made once and used for all its takes.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from sogjax.cli import actor as actor_command
from sogjax.cli.sweep.folders import ACTORS, KEY, places_of, recordings_in, whole_path
from sogjax.cli.sweep.results import NO_RESULT, Member, Row, forget_failure, keep_row, reason, row_of
from sogjax.cli.sweep.tables import finish_takes
from sogjax.cli.words import composed, parsed, quoted_value
from sogjax.errors import InputError, counted
from sogjax.io.recording_files import ACTOR, SETTINGS, named_subjects, posed_subjects
from sogjax.run.run_folder import results_folder
from sogjax.run.terminal import say
from sogjax.settings.run import ActorConfig, TrackConfig

TRIED = 3
"""Takes of a subject that an actor is tried to be made of."""


@dataclass(frozen=True)
class Subjects:
    """The folder of the actor files `SUBJECT.yaml`, and which takes may serve to make those that are missing.

    With `overwrite` in the settings those that are there are made anew.
    """

    folder: Path
    takes: Sequence[Path]
    makes: bool
    """Whether missing ones are made; not in a folder that the user named."""

    def actor_of(self, take: Path, config: TrackConfig, failed: dict[str, str]) -> list[str] | None:
        """The actor files of a take; None: nobody is named, so its own is made of its example poses or its videos.

        `failed` tells by subject why no actor could be made, an empty text where it was made, and is added to.

        Raises:
            InputError: the take's settings cannot be read, or there is no actor of one of its subjects.
        """
        if self.makes and ACTOR.of(take).is_file():
            return [str(ACTOR.of(take))]
        subjects = named_subjects(take)
        if not subjects and not self.makes:
            raise InputError(
                f"actor={self.folder}: is a folder of actors by the names of subjects, but {SETTINGS.of(take)} "
                "does not name its own; add `subject: NAME` there"
            )
        files = [self.folder / f"{subject}.yaml" for subject in subjects]
        for subject, file in zip(subjects, files, strict=True):
            if file.is_file() and not (self.makes and config.overwrite):
                continue
            if not self.makes:
                remedy = f"make it with sogjax actor recording={take} out={file}"
                raise InputError(f"{self.folder}: has no {file.name}, the actor of {take}; {remedy}")
            if subject not in failed:
                failed[subject] = self._made(subject, file, config)
            if failed[subject]:
                raise InputError(f"no actor of {subject}: {failed[subject]}")
        return [str(file) for file in files] or None

    def _made(self, subject: str, file: Path, config: TrackConfig) -> str:
        """Make an actor of the first take that lends itself; why that cannot be done, else an empty text."""
        reasons = []
        for take, chosen in self._sources(subject)[:TRIED]:
            say(f"\n== actor {subject}, of {take}, for all recordings of this subject")
            settings = ActorConfig(recording=str(take), out=str(file), subject=chosen, body=config.body)
            settings = replace(settings, cameras=config.cameras, color=config.color, overwrite=config.overwrite)
            try:
                actor_command.run(settings, subject)
                return ""
            except Exception as error:  # another take may do, and the takes of others
                reasons.append(reason(error, "an actor was not made"))
            say(f"no actor of {take}: {reasons[-1]}")
        return reasons[0] if reasons else f"no recording shows {subject} alone or in example poses of its own"

    def _sources(self, subject: str) -> list[tuple[Path, str | None]]:
        """Takes that an actor can be made of, those with example poses first; whom their example poses call so."""
        posed: list[tuple[Path, str | None]] = []
        filmed: list[tuple[Path, str | None]] = []
        for take in self.takes:
            try:
                named, shown = named_subjects(take), posed_subjects(take)
            except InputError:
                continue  # it fails by itself
            if subject in shown:
                posed.append((take, subject))
            elif named == (subject,):
                (posed if shown else filmed).append((take, None))
        return posed + filmed


SWEEP_FOLDERS = ("hydra.sweep.dir", "hydra.sweep.subdir")
"""Where the members of a sweep over settings lie."""


@dataclass(frozen=True)
class Take:
    """A recording among several."""

    recording: Path
    place: str
    """Where its results lie, from the folder of all of them."""


def is_of_takes(words: Sequence[str], by_pattern: bool = False) -> bool:
    """Whether the words of a sweep name several recordings, or any `by_pattern`, and sweep over nothing else."""
    try:
        swept = [override.get_key_element() for override in parsed(words) if override.is_sweep_override()]
    except InputError:
        return False
    own_sweeper = any(word.startswith("hydra/sweeper=") for word in words)
    return (swept == [KEY] or (by_pattern and not swept)) and not own_sweeper


def track_takes(words: Sequence[str], run: Callable[[list[str]], int], root: Path | None = None) -> int:
    """Track several recordings into a folder for each, and print and write their table.

    Args:
        words: of the sweep.
        run: runs words by Hydra.
        root: the folder from which the recordings' names are counted; None: what they have in common.

    Raises:
        InputError: a setting is invalid, or some recordings failed.
    """
    _check_folders(words)
    paths = [whole_path(path) for path in recordings_in(words)]
    takes = [Take(path, place) for path, place in zip(paths, places_of(paths, root), strict=True)]
    others = [word for word in words if word.partition("=")[0] != KEY]
    own = [word for word in others if not word.lstrip("+~").startswith("hydra")]
    config: TrackConfig = composed("track", [*own, f"{KEY}={quoted_value(str(takes[0].recording))}"])
    out = Path(config.out or "outputs").absolute()
    with results_folder(out):
        for take in takes:
            forget_failure(out / take.place)
        ready = _ready(takes, config, out)
        problem = _run(ready, others, out, run) if ready else None
        rows = [row_of(take.place, out / take.place) for take in takes]
        finish_takes(out, rows)
    _check_rows(rows, problem)
    return 0


def _check_folders(words: Sequence[str]) -> None:
    for word in words:
        if word.partition("=")[0].lstrip("+~") in SWEEP_FOLDERS:
            raise InputError(f"{word}: results of several recordings lie by their names in out; use out=DIR instead")


def _check_rows(rows: Sequence[Row], problem: InputError | None) -> None:
    """A problem that kept a recording from having any result is told rather than how many failed.

    Raises:
        InputError: there was a problem, or some recordings failed.
    """
    failed = [row.failed for row in rows if row.failed]
    if problem and (not failed or NO_RESULT in failed):
        raise problem
    if failed:
        raise InputError(
            f"{len(failed)} of {counted(len(rows), 'recording')} failed; the first: {failed[0]} "
            "(the same command again does these only)"
        )


def _ready(takes: Sequence[Take], config: TrackConfig, out: Path) -> list[tuple[Take, list[str] | None]]:
    """The takes whose actors are there, with these; why the others have none is kept as their result."""
    given = Path(config.actor) if isinstance(config.actor, str) and Path(config.actor).is_dir() else None
    if config.actor is not None and given is None:
        return [(take, None) for take in takes]
    subjects = Subjects(given or out / ACTORS, [take.recording for take in takes], makes=given is None)
    failed: dict[str, str] = {}
    ready = []
    for take in takes:
        try:
            ready.append((take, subjects.actor_of(take.recording, config, failed)))
        except Exception as error:
            why = reason(error, "a recording has no actor")
            say(f"{take.place}: {why}")
            keep_row(out / take.place, Member([], why))
    return ready


def _run(
    ready: Sequence[tuple[Take, list[str] | None]], words: Sequence[str], out: Path, run: Callable[[list[str]], int]
) -> InputError | None:
    """Let Hydra's launcher track them; what was wrong, if anything was."""
    listed = ",".join(quoted_value(str(take.recording)) for take, _ in ready)
    own = [word for word in words if word.partition("=")[0] not in ("out", "actor")]
    actor = [word for word in words if word.startswith("actor=") and ready[0][1] is None]
    places = [out / take.place for take, _ in ready]
    members = ",".join(
        f"{{out:{quoted_value(str(place))},actor:{_list(actor)}}}"
        for place, (_, actor) in zip(places, ready, strict=True)
    )
    hydras = [
        f"hydra.sweep.dir={quoted_value(str(out))}",
        "hydra.sweep.subdir='${oc.select:hydra.callbacks.table.takes.${hydra.job.num}.out}'",
        f"+hydra.callbacks.table.takes=[{members}]",
    ]
    with suppress(OSError):
        for place in places:
            place.mkdir(parents=True, exist_ok=True)
    try:
        run([*own, *actor, f"{KEY}={listed}", *hydras])
    except InputError as error:
        return error
    return None


def _list(files: Sequence[str] | None) -> str:
    return "null" if files is None else f"[{','.join(map(quoted_value, files))}]"
