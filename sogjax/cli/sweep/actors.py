"""The actors of several recordings: one for each subject, made once and used for all takes of it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from sogjax.cli import actor as actor_command
from sogjax.cli.sweep.results import reason
from sogjax.errors import InputError
from sogjax.io.recording_files import ACTOR, SETTINGS, named_subjects, posed_subjects
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
