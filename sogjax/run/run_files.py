"""The register of a run's files: one list by which they are written, resumed, replaced, cleaned up and described."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from sogjax.io.export.write import WRITERS
from sogjax.io.files import objection
from sogjax.io.frame_motions import PARTIAL


@dataclass(frozen=True)
class RunFile:
    """A file that a run may leave in its folder."""

    name: str
    """Its name without the actor's, which several actors add to the stem."""
    holds: str
    of_actors: bool = False
    """Whether there is one for each actor."""
    is_folder: bool = False
    certain: bool = True
    """Whether a file of this name is a run's for sure; else it may be the user's own, and only counts where the run's
    note lists it."""

    def of(self, folder: Path, actor: str = "", num_actors: int = 1) -> Path:
        """Its path in a folder: `motion.npz`, or with several actors `motion_NAME.npz`."""
        stem, ending = self._parts
        return folder / (f"{stem}_{actor}{ending}" if self.of_actors and num_actors > 1 else self.name)

    def matches(self, name: str) -> bool:
        """Whether a file of this name is one, of whatever actor."""
        stem, ending = self._parts
        return name == self.name or (self.of_actors and name.startswith(f"{stem}_") and name.endswith(ending))

    @property
    def _parts(self) -> tuple[str, str]:
        """Stem and ending, which may have several words: `.lafan1.bvh`."""
        stem, dot, ending = self.name.partition(".")
        return stem, dot + ending

    def found(self, folder: Path) -> set[Path]:
        """The files of this name that are there."""
        return {path for path in folder.glob(self.name) if path.is_dir() == self.is_folder or path.is_symlink()}


NOTE = RunFile("run.json", "what the run was made of, its files and times")
KEPT = RunFile(PARTIAL, "what a run that has not ended has found so far; removed at its end", is_folder=True)
MOTIONS = {
    ending: RunFile(f"motion{ending}", f"the motion as {ending[1:].upper()}", of_actors=True) for ending in WRITERS
}
MOTION = MOTIONS[".npz"]
ACTOR = RunFile("actor.yaml", "the actor, if the run made or adjusted it", of_actors=True, certain=False)
CONFIG = RunFile("config.yaml", "all settings")
METRICS = RunFile("metrics.json", "the verdict, and the errors where there is a truth")
OVERLAY = RunFile("overlay.mp4", "the skeleton on every camera's pictures")
PAGE = RunFile("index.html", "all of it on one page: verdict, timeline, pictures, curves")
RERUN = RunFile("motion.rrd", "everything for the Rerun viewer")
WORST = RunFile("worst.png", "the five frames that fit worst")
UNADJUSTED = RunFile("unadjusted.npz", "the motion as it was before it was adjusted")
UNADJUSTED_ACTOR = RunFile("unadjusted_actor.yaml", "the actor before it was adjusted")
ADJUSTMENT = RunFile("adjustment.json", "what adjusting changed")
CALIBRATION = RunFile("calibration_adjusted.toml", "the cameras where adjusting found them")
DESCRIPTION = RunFile("recording.yaml", "a recording.yaml that names that calibration and time offsets", certain=False)
GUESS = RunFile("initial_pose.png", "the best guess of an initial pose that was not sure")
LIVE = RunFile("live.json", "the figures of live tracking: latencies, and what was lost why", certain=False)
OCCLUDERS = RunFile("occluders.png", "what was learnt to stand in front, where something was")

RUN_FILES: tuple[RunFile, ...] = (
    *(NOTE, KEPT, *MOTIONS.values(), ACTOR, CONFIG, METRICS, PAGE, OVERLAY, RERUN, WORST),
    *(UNADJUSTED, UNADJUSTED_ACTOR, ADJUSTMENT, CALIBRATION, DESCRIPTION, GUESS, OCCLUDERS, LIVE),
)
_OLDER = (RunFile("motion.partial", "", is_folder=True), RunFile("motion_*.partial", "", is_folder=True))
"""Frames so far of runs of earlier versions."""
_NO_RESULT = (GUESS,)
"""Files that do not stand in the way of another run."""


def left_in(folder: Path, listed: Iterable[object] = ()) -> list[Path]:
    """All that an earlier run left in a folder; `listed` are the files in its note.

    Anybody may have written the note, so only names in this very folder count.
    """
    if not folder.is_dir():
        return []
    found = {path for each in (*RUN_FILES, *_OLDER) if each.certain for path in each.found(folder)}
    named = {folder / name for name in listed if isinstance(name, str) and objection(name) is None}
    return sorted(found | {path for path in named if path.is_file() or path.is_symlink()})


def in_the_way(folder: Path, listed: Iterable[object] = ()) -> list[Path]:
    """The results in a folder that another run must not replace unasked, those of several actors among them."""
    results = [path for path in left_in(folder, listed) if path.name not in {each.name for each in _NO_RESULT}]
    motions = [path for path in folder.glob("*") if any(each.matches(path.name) for each in MOTIONS.values())]
    return results or sorted(motions)


def half_written(folder: Path) -> list[Path]:
    """Files under temporary names, left by a run that was killed."""
    stems = "|".join(sorted({re.escape(Path(each.name).stem) for each in RUN_FILES if not each.is_folder}))
    pattern = re.compile(rf"\.({stems})(_.*)?\.[0-9a-f]{{8}}\.tmp(\..*)?|\.probe-[0-9a-f]*")
    return [path for path in folder.iterdir() if pattern.fullmatch(path.name) and not path.is_dir()]
